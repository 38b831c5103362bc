#pragma once
// Joint angles of a contact over EKI: from the controller's own latch, or interpolated in the
// recorded path, and cross-checked.

#include <optional>

#include "drivers/contact.h"
#include "drivers/kuka/eki/eki_config.h"
#include "drivers/kuka/moves/cause.h"
#include "drivers/kuka/moves/position_record.h"

namespace cellcal::drivers {

struct EkiLatchResult {
  std::optional<Latch> latch;
  Cause cause;  ///< reason if there are no angles
};

struct EkiTouch {
  ContactEvent contact;                   ///< from the sensor
  std::optional<AxisAngles> latched_rad;  ///< $AXIS_INT of this move
  AxisAngles settled_rad;
  TimePoint stopped_at{};  ///< arrival of the state that reported the stop
};

/// `now` is the time reference of errors. A latch must match the measured path at the sensor's time
/// stamp; its delay is compensated with the speed before the contact.
EkiLatchResult latch_of(const EkiTouch& touch, const EkiConfig& config,
                        const PositionRecord& record, TimePoint now);

}  // namespace cellcal::drivers
