#pragma once
// What stands on a certificate beside the form's own words, and where it was taken from (README, Origins).

#include <optional>
#include <string>

namespace cellcal::daemon::certificate {

struct Entry {
  std::string text;               ///< as printed, not escaped; empty: not stated
  std::string from;               ///< origin
  std::optional<double> value{};  ///< of a number, in `unit`, all its digits
  std::string unit{};

  bool stated() const { return !text.empty(); }
};

/// Fixed decimals, a real minus sign.
Entry figure(double value, const std::string& unit, int decimals, const std::string& from);
/// The same with the ASCII minus, for what people copy into files.
Entry raw_figure(double value, const std::string& unit, int decimals, const std::string& from);
/// A time as the journal has it, by the clock on the wall of this computer, with its zone.
Entry local(const Entry& utc);
/// "2026-11-22 19:05:00 CET (UTC+0100)"; empty where it is no time. Not escaped.
std::string local_words(const std::string& iso);

/// The coverage factor.
inline constexpr double kCoverage = 2.0;

}  // namespace cellcal::daemon::certificate
