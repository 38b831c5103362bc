#include "daemon/report/scale.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "calib/model/units.h"

namespace cellcal::daemon::report {

namespace {

// A narrower relative range has no ticks distinguishable in double precision.
constexpr double kLeastRelativeRange = 1e-9;
constexpr int kMostDecimals = 9;

}  // namespace

double Scale::operator()(double value) const {
  return at_from + (value - from) / (to - from) * (at_to - at_from);
}

double Scale::clamped(double value) const {
  return (*this)(std::clamp(value, std::min(from, to), std::max(from, to)));
}

bool Scale::holds(double value) const {
  return value >= std::min(from, to) && value <= std::max(from, to);
}

std::vector<double> round_ticks(double from, double to, int wanted) {
  const double magnitude = std::max(std::abs(from), std::abs(to));
  if (!std::isfinite(magnitude) || !std::isfinite(to - from) || wanted < 1) return {};
  if (!(to - from > kLeastRelativeRange * magnitude)) return {};
  const double raw = (to - from) / wanted;
  const double decade = std::pow(10.0, std::floor(std::log10(raw)));
  double step = 10.0 * decade;
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (factor * decade >= raw * (1.0 - kLeastRelativeRange)) {
      step = factor * decade;
      break;
    }
  }
  std::vector<double> ticks;
  const double first = std::ceil(from / step - kLeastRelativeRange);
  const double last = std::floor(to / step + kLeastRelativeRange);
  for (double i = first; i <= last; i += 1.0) ticks.push_back(i * step);
  return ticks;
}

std::vector<std::string> tick_labels(const std::vector<double>& ticks) {
  int decimals = 0;
  if (ticks.size() > 1) {
    const double step = ticks[1] - ticks[0];
    decimals = std::clamp(static_cast<int>(std::ceil(-std::log10(step) - 1e-6)), 0, kMostDecimals);
  }
  std::vector<std::string> labels;
  labels.reserve(ticks.size());
  for (const double tick : ticks) labels.push_back(fixed(tick, decimals));
  return labels;
}

double round_up(double value, double fallback) {
  if (!std::isfinite(value) || value <= 0.0) return fallback;
  const double decade = std::pow(10.0, std::floor(std::log10(value)));
  for (const double factor : {1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0}) {
    if (factor * decade >= value * (1.0 - kLeastRelativeRange)) return factor * decade;
  }
  return 10.0 * decade;
}

namespace {

constexpr std::string_view kMinus = "\xE2\x88\x92";  // U+2212
constexpr std::string_view kDash = "\xE2\x80\x93";   // U+2013
constexpr double kTooLargeForFixed = 1e9;

std::string with_real_minus(std::string_view text) {
  std::string out;
  out.reserve(text.size() + kMinus.size());
  for (const char c : text) {
    if (c == '-') {
      out += kMinus;
    } else {
      out += c;
    }
  }
  return out;
}

}  // namespace

std::string ascii_fixed(double value, int decimals) {
  if (!std::isfinite(value)) return std::string(kDash);
  if (std::abs(value) >= kTooLargeForFixed) return fmt::format("{:.{}e}", value, decimals);
  std::string text = fmt::format("{:.{}f}", value, decimals);
  if (text.front() == '-' && text.find_first_of("123456789") == std::string::npos) text.erase(0, 1);
  return text;
}

std::string fixed(double value, int decimals) {
  return with_real_minus(ascii_fixed(value, decimals));
}

std::string signed_fixed(double value, int decimals) {
  const std::string text = ascii_fixed(value, decimals);
  const bool plus = std::isfinite(value) && text.front() != '-' &&
                    text.find_first_of("123456789") != std::string::npos;
  return plus ? fmt::format("+{}", text) : with_real_minus(text);
}

std::string significant(double value, int digits) {
  if (!std::isfinite(value)) return std::string(kDash);
  if (value == 0.0) return "0";
  return with_real_minus(fmt::format("{:.{}g}", value, digits));
}

std::string mm(double metres, int decimals) { return fixed(metres * calib::kMmPerM, decimals); }

std::string signed_mm(double metres, int decimals) {
  return signed_fixed(metres * calib::kMmPerM, decimals);
}

std::string positive_mm(double metres, int decimals) {
  return metres > 0.0 ? mm(metres, decimals) : std::string(kDash);
}

std::string mm_words(double metres) { return mm(metres) + "\xC2\xA0mm"; }

std::string readable_time(std::string_view iso) {
  constexpr std::string_view kPattern = "dddd-dd-ddTdd:dd:dd";
  bool matches = iso.size() > kPattern.size() && iso.back() == 'Z';
  for (std::size_t i = 0; matches && i < kPattern.size(); ++i) {
    const bool digit = iso[i] >= '0' && iso[i] <= '9';
    matches = kPattern[i] == 'd' ? digit : iso[i] == kPattern[i];
  }
  // Between seconds and Z only a fraction is permitted; it is dropped.
  const std::string_view rest = matches ? iso.substr(kPattern.size()) : std::string_view();
  matches =
      matches && (rest.size() == 1 || rest[0] == '.') &&
      rest.substr(0, rest.size() - 1).find_first_not_of(".0123456789") == std::string_view::npos;
  if (!matches) return std::string(iso);
  return fmt::format("{} {} UTC", iso.substr(0, 10), iso.substr(11, 8));
}

std::string counted(std::size_t count, std::string_view one, std::string_view many) {
  return fmt::format("{} {}", count, count == 1 ? one : many);
}

}  // namespace cellcal::daemon::report
