#include "daemon/certificate/entry.h"

#include <time.h>

#include <cmath>

#include "calib/model/iso_time.h"
#include "daemon/report/drawing/text.h"

namespace cellcal::daemon::certificate {

Entry figure(double value, const std::string& unit, int decimals, const std::string& from) {
  if (!std::isfinite(value)) return {"", from};
  return {report::fixed(value, decimals), from, value, unit};
}

Entry raw_figure(double value, const std::string& unit, int decimals, const std::string& from) {
  if (!std::isfinite(value)) return {"", from};
  return {report::ascii_fixed(value, decimals), from, value, unit};
}

Entry local(const Entry& utc) { return {local_words(utc.text), "local(" + utc.from + ")"}; }

std::string local_words(const std::string& iso) {
  const auto seconds = calib::seconds_of(iso);
  if (!seconds) return {};
  const auto time = static_cast<time_t>(std::floor(*seconds));
  struct tm fields {};
  ::tzset();
  if (::localtime_r(&time, &fields) == nullptr) return {};
  char text[64];
  const std::size_t length = ::strftime(text, sizeof text, "%Y-%m-%d %H:%M:%S %Z (UTC%z)", &fields);
  return {text, length};
}

}  // namespace cellcal::daemon::certificate
