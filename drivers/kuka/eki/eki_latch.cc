#include "drivers/kuka/eki/eki_latch.h"

#include <cmath>

#include "drivers/units.h"

namespace cellcal::drivers {
namespace {

// Plausibility window of a latch around the sensor's time stamp on the measured path: states are
// interpolated over 20 ms of motion and of braking, and stamps are up to 12 ms old.
constexpr double kLatchWindowS = 0.06;
constexpr double kLatchSlackRad = 0.02 * kRadPerDeg;
// Interval over which the search speed is taken from the record.
constexpr double kSpeedSpanS = 0.1;
constexpr double kSecondsPerMs = 1e-3;

}  // namespace

EkiLatchResult latch_of(const EkiTouch& touch, const EkiConfig& config,
                        const PositionRecord& record, TimePoint now) {
  const TimePoint edge = touch.contact.first_edge;
  const auto path = record.actual_at(edge, kSecondsPerMs);
  // A time stamp outside the record cannot belong to this contact.
  if (!path) return {std::nullopt, cause::StampOutside{seconds(now - edge)}};
  Latch latch;
  latch.contact_rad = *path;
  latch.settled_rad = touch.settled_rad;
  latch.contact_time = edge;
  latch.time_sigma_s = std::hypot(touch.contact.time_sigma_s, config.flag_sigma_s);
  latch.reaction_s = seconds(touch.stopped_at - edge);
  latch.bounces = touch.contact.bounces;
  if (config.stop == EkiStop::kFlag) return {latch, cause::None{}};

  if (!touch.latched_rad) return {std::nullopt, cause::LatchMissing{}};
  const auto span =
      std::chrono::duration_cast<Duration>(std::chrono::duration<double>(kSpeedSpanS));
  const auto before = record.actual_at(edge - span, kSecondsPerMs);
  for (std::size_t i = 0; i < path->size(); ++i) {
    const double latched = (*touch.latched_rad)[i];
    const double speed = before ? ((*path)[i] - (*before)[i]) / kSpeedSpanS : 0.0;
    const double allowed =
        kLatchSlackRad + std::abs(speed) * (kLatchWindowS + std::abs(config.latch_delay_s));
    if (std::abs(latched - (*path)[i]) > allowed) {
      return {std::nullopt, cause::LatchAstray{static_cast<std::uint8_t>(i), latched * kDegPerRad,
                                               (*path)[i] * kDegPerRad}};
    }
    latch.contact_rad[i] = latched - speed * config.latch_delay_s;
  }
  latch.time_sigma_s = config.latch_jitter_s;
  return {latch, cause::None{}};
}

}  // namespace cellcal::drivers
