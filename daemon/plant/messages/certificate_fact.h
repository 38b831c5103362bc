#pragma once
// A certificate on its way to the plant: whole, or not at all.

#include <stdexcept>

#include "daemon/plant/messages/fact.h"

namespace cellcal::daemon::plant {

/// As base64 in JSON it is less than kLargestMessage and what the shipped broker takes.
inline constexpr std::size_t kMostCertificateBytes = 5'500'000;

/// The plant is not told of it. The certificate itself stands.
struct CertificateTooLarge : std::runtime_error {
  explicit CertificateTooLarge(std::size_t all);
  std::size_t bytes;
};

/// Throws CertificateTooLarge.
CertificateFact certificate_fact(std::string number, std::vector<CertificateFile> files);

/// As daemon/certificate numbers it: "emulated-" where no real arm was touched, the session, and the first 12 digits of
/// its calibration's SHA-256.
std::string certificate_number(std::int64_t session, const std::string& calibration, bool emulated);

}  // namespace cellcal::daemon::plant
