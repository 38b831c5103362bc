#include "drivers/kuka/rsi/ipoc_clock.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace cellcal::drivers {

namespace {

constexpr std::size_t kParts = 4;
// Between quarters of half a second each: programs that sleep lose 1 % and more, 5 ms; two quartzes
// 0.1 ms.
constexpr double kKeepsTimeS = 0.002;

/// Earliest arrival relative to the counter in each quarter of the record [s], the newest first.
std::array<double, kParts> earliest_s(const PositionRecord& record, double seconds_per_count) {
  const PositionRecord::Sample& last = record.newest();
  std::array<double, kParts> earliest;
  earliest.fill(std::numeric_limits<double>::infinity());
  for (std::size_t i = 0; i < record.size(); ++i) {
    const PositionRecord::Sample& sample = record.newest(i);
    // IPOC wraps: only differences are meaningful.
    const auto counts = static_cast<std::int32_t>(sample.ipoc - last.ipoc);
    double& least_s = earliest[i * kParts / record.size()];
    least_s = std::min(least_s, seconds(sample.t_rx - last.t_rx) - counts * seconds_per_count);
  }
  return earliest;
}

/// A single step between quarters is caused by the network; a peer that lags in most of them has no
/// clock.
bool keeps_time(const std::array<double, kParts>& earliest) {
  std::array<double, kParts - 1> steps{};
  for (std::size_t i = 0; i < steps.size(); ++i) steps[i] = std::abs(earliest[i] - earliest[i + 1]);
  std::sort(steps.begin(), steps.end());
  return steps[steps.size() / 2] <= kKeepsTimeS;
}

std::optional<AnglesAt> by_arrival(const PositionRecord& record, TimePoint t) {
  if (record.size() < 2 || t > record.newest().t_rx) return std::nullopt;
  std::size_t before = 1;
  while (before < record.size() && record.newest(before).t_rx > t) ++before;
  if (before == record.size()) return std::nullopt;
  const auto interval_s = [&](std::size_t i) {  // from the preceding packet to packet i
    if (i + 1 >= record.size()) return 0.0;
    return seconds(record.newest(i).t_rx - record.newest(i + 1).t_rx);
  };
  const std::size_t after = before - 1;
  const double between_s = interval_s(after);
  const double u = between_s > 0.0 ? seconds(t - record.newest(before).t_rx) / between_s : 0.0;
  AnglesAt found{record.newest(before).actual_rad, 0.0};
  for (std::size_t i = 0; i < found.actual_rad.size(); ++i) {
    found.actual_rad[i] += u * (record.newest(after).actual_rad[i] - found.actual_rad[i]);
  }
  // Late processing of a packet lengthens the interval before it, or the one after it.
  const double longest_s =
      std::max({between_s, interval_s(before), after > 0 ? interval_s(after - 1) : 0.0});
  found.time_sigma_s = longest_s / std::sqrt(3.0);
  return found;
}

}  // namespace

std::optional<AnglesAt> angles_at(const PositionRecord& record, TimePoint t,
                                  const IpocClock& clock) {
  if (!clock.milliseconds || record.size() < kParts) return by_arrival(record, t);
  const auto earliest = earliest_s(record, clock.seconds_per_count);
  if (!keeps_time(earliest)) return by_arrival(record, t);
  const auto at = record.actual_at(t, clock.seconds_per_count);
  if (!at) return std::nullopt;
  const auto [least, most] = std::minmax_element(earliest.begin(), earliest.end());
  return AnglesAt{*at, *most - *least};
}

}  // namespace cellcal::drivers
