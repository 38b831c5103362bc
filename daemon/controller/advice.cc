#include "daemon/controller/advice.h"

#include <chrono>

#include "calib/check/charts.h"

namespace cellcal::daemon {

using calib::DriftAdvice;

const char* to_string(Advice advice) {
  switch (advice) {
    case Advice::kUnknown:
      break;
    case Advice::kHolds:
      return "holds";
    case Advice::kCheckAgain:
      return "check_again";
    case Advice::kLetItWarmUp:
      return "let_it_warm_up";
    case Advice::kRemeasureTcp:
      return "re_measure_tcp";
    case Advice::kRecalibrate:
      return "recalibrate";
  }
  return "unknown";
}

int day_number(double utc_s) {
  using namespace std::chrono;
  const year_month_day day{
      floor<days>(sys_time<seconds>(seconds(static_cast<std::int64_t>(utc_s))))};
  return static_cast<int>(day.year()) * 372 +
         static_cast<int>(static_cast<unsigned>(day.month())) * 31 +
         static_cast<int>(static_cast<unsigned>(day.day()));
}

PublishedAdvice advice_of(const calib::DriftChart& chart, double now_s) {
  constexpr double kDayS = 86400.0;
  switch (chart.advice) {
    case DriftAdvice::kNone:
      break;
    case DriftAdvice::kCheckAgain:
      return {Advice::kCheckAgain};
    case DriftAdvice::kLetItWarmUp:
      return {Advice::kLetItWarmUp};
    case DriftAdvice::kRemeasureTcp:
      return {Advice::kRemeasureTcp};
    case DriftAdvice::kRecalibrate:
      return {Advice::kRecalibrate};
  }
  const calib::CheckSeen* decided = chart.newest_decided();
  if (decided == nullptr || decided->verdict != calib::CheckVerdict::kHolds) return {};
  const double until_s = decided->time_s + calib::kMostDays * kDayS;
  if (now_s > until_s) return {};
  return {Advice::kHolds, day_number(until_s)};
}

}  // namespace cellcal::daemon
