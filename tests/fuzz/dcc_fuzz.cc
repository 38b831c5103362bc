// Any bytes as a Digital Calibration Certificate: refused with a FileError of one line that names a line of the
// file, or read as spheres and lengths valid in a cell file: finite, with unique, bounded and printable names.

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <set>
#include <string>
#include <string_view>
#include <utility>

#include "calib/files/text.h"
#include "calib/model/error.h"
#include "daemon/cell_form/cell_text.h"

namespace {

using namespace cellcal;  // NOLINT: a fuzz target's own file

void require(bool condition, const char* what) {
  if (condition) return;
  std::fprintf(stderr, "broken promise: %s\n", what);
  std::abort();
}

constexpr std::string_view kFile = "fuzz.xml";

void require_refusal(std::string_view words, std::string_view xml) {
  constexpr std::size_t kLongest = 2000;
  require(words.size() < kLongest, "a refusal is no copy of the file");
  require(!calib::has_control(words), "a refusal is one line");
  require(words.starts_with(kFile), "a refusal names the file");
  words.remove_prefix(kFile.size() + 1);
  std::ptrdiff_t line = 0;
  const auto [end, error] = std::from_chars(words.data(), words.data() + words.size(), line);
  if (error != std::errc()) return;
  require(line >= 1 && line <= 1 + std::ranges::count(xml, '\n'), "the line is one of the file");
}

void require_text(std::string_view text, std::size_t most) {
  require(text.size() <= most, "texts of the cell file are short");
  require(!calib::has_control(text), "texts of the cell file fit a line");
}

void require_value(double mm, double sigma_mm, const daemon::CertificateForm& of) {
  require(std::isfinite(mm) && mm > 0.0, "lengths are finite and above 0");
  require(sigma_mm > 0.0 && sigma_mm <= 1.0, "a sigma is a certificate's");
  require_text(of.number, 250);
  require_text(of.date, 10);
}

void read_spheres(std::string_view xml) try {
  std::set<std::string> ids;
  for (const daemon::SphereForm& one : daemon::spheres_in_dcc(xml, std::string(kFile))) {
    require(!one.id.empty() && ids.insert(one.id).second, "each sphere has a name of its own");
    require_text(one.id, 70);
    require_text(one.serial, 70);
    require_value(one.diameter_mm, one.diameter_sigma_mm, one.certificate);
  }
  require(!ids.empty(), "what has no sphere is refused");
} catch (const calib::FileError& refused) {
  require_refusal(refused.what(), xml);
}

void read_lengths(std::string_view xml) try {
  std::set<std::pair<std::string, std::string>> pairs;
  for (const daemon::LengthForm& one : daemon::lengths_in_dcc(xml, std::string(kFile))) {
    require(one.from != one.to, "a length lies between two spheres");
    require(pairs.insert(std::minmax(one.from, one.to)).second, "two spheres have one length");
    require_value(one.mm, one.sigma_mm, one.certificate);
  }
  require(!pairs.empty(), "what has no length is refused");
} catch (const calib::FileError& refused) {
  require_refusal(refused.what(), xml);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view xml(reinterpret_cast<const char*>(data), size);
  read_spheres(xml);
  read_lengths(xml);
  return 0;
}
