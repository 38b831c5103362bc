#include "daemon/result/contact_delay.h"

#include <fmt/format.h>

#include <cmath>
#include <numbers>
#include <numeric>

#include "calib/model/linear.h"
#include "calib/model/units.h"

namespace cellcal::daemon {

namespace {

constexpr std::size_t kFewest = 5;
/// 40 um of depth at the slow speed (2 mm/s).
constexpr double kSuspiciousS = 0.020;
/// 4 um of effective radius.
constexpr double kChangeS = 0.002;
constexpr double kMiddleSigmas = 4.0;

}  // namespace

std::optional<ContactDelay> contact_delay(std::span<const FastAndSlow> touches, double fast_m_s,
                                          double slow_m_s) {
  const double difference = fast_m_s - slow_m_s;
  if (touches.size() < kFewest || !(difference >= kLeastSpeedDifferenceMS)) return std::nullopt;
  std::vector<double> delays;
  for (const FastAndSlow& touch : touches)
    delays.push_back((touch.fast_m - touch.slow_m) / difference);
  ContactDelay result;
  result.touches = static_cast<int>(delays.size());
  result.delay_s = calib::median_between(delays);
  for (double& delay : delays) delay = std::abs(delay - result.delay_s);
  // For a normal distribution: sigma from the median absolute deviation, and that of the median of n values. The deviation of
  // few is itself uncertain: with 1 + 5 / n two sigmas hold 93 % of 5 values, 95 % of 6 and 7, 96 % of 8 and more.
  const double n = result.touches;
  result.sigma_s = calib::kMadToSigma * calib::median_between(delays) *
                   std::sqrt(std::numbers::pi / 2.0 / n) * (1.0 + 5.0 / n);
  return result;
}

std::string in_words(const ContactDelay& delay) {
  return fmt::format("{:.2f} ± {:.2f} ms (k=2) of {} touches", calib::kMsPerS * delay.delay_s,
                     calib::kMsPerS * 2.0 * delay.sigma_s, delay.touches);
}

std::string complaint(const ContactDelay& now, const std::optional<ContactDelay>& before) {
  if (std::abs(now.delay_s) > kSuspiciousS + kMiddleSigmas * now.sigma_s)
    return fmt::format(
        "angles latched {:.0f} ms {} the contact. EKI: add this to [eki] latch_delay_ms. RSI: "
        "check the sensor's clock and the network's delay",
        std::abs(calib::kMsPerS * now.delay_s), now.delay_s > 0.0 ? "after" : "before");
  if (!before) return {};
  const double change = now.delay_s - before->delay_s;
  if (std::abs(change) > kChangeS + kMiddleSigmas * std::hypot(now.sigma_s, before->sigma_s))
    return fmt::format(
        "{} in the session before: sensor, wiring or controller changed in between, and the "
        "effective radius with them. Find out what was changed",
        in_words(*before));
  return {};
}

double TouchContacts::slow_mean_m() const {
  return std::accumulate(slow_m.begin(), slow_m.end(), 0.0) / static_cast<double>(slow_m.size());
}

std::map<std::size_t, TouchContacts> contacts_of(std::span<const RecordReading> readings) {
  std::map<std::size_t, TouchContacts> contacts;
  for (const RecordReading& one : readings) {
    if (!std::isfinite(one.reading.along_m)) continue;
    TouchContacts& touch = contacts[one.touch];
    if (one.reading.slow)
      touch.slow_m.push_back(one.reading.along_m);
    else
      touch = {one.reading.along_m, {}};
  }
  return contacts;
}

std::vector<FastAndSlow> fast_and_slow(std::span<const RecordReading> readings,
                                       std::size_t touches) {
  std::vector<FastAndSlow> both;
  for (const auto& [index, touch] : contacts_of(readings))
    if (index < touches && touch.fast_m && !touch.slow_m.empty())
      both.push_back({*touch.fast_m, touch.slow_mean_m()});
  return both;
}

}  // namespace cellcal::daemon
