#include "daemon/plant/messages/certificate_fact.h"

#include "calib/files/input_file.h"

namespace cellcal::daemon::plant {

namespace {

std::string megabytes(std::size_t bytes) {
  constexpr std::size_t kTenth = 100'000;
  const std::size_t tenths = (bytes + kTenth - 1) / kTenth;
  return std::to_string(tenths / 10) + "." + std::to_string(tenths % 10) + " MB";
}

}  // namespace

CertificateTooLarge::CertificateTooLarge(std::size_t all)
    : std::runtime_error(
          megabytes(all) + " of certificate, at most " + megabytes(kMostCertificateBytes) +
          " can be sent to the plant. Hand its files on another way; without the PDF (--no-pdf) it is smaller"),
      bytes(all) {}

CertificateFact certificate_fact(std::string number, std::vector<CertificateFile> files) {
  std::size_t bytes = 0;
  for (const CertificateFile& file : files) bytes += file.bytes.size();
  if (bytes > kMostCertificateBytes) throw CertificateTooLarge(bytes);
  return {std::move(number), std::move(files)};
}

std::string certificate_number(std::int64_t session, const std::string& calibration,
                               bool emulated) {
  constexpr std::size_t kDigits = 12;
  return (emulated ? "emulated-" : "") + std::to_string(session) + "-" +
         calib::sha256(calibration).substr(0, kDigits);
}

}  // namespace cellcal::daemon::plant
