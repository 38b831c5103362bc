#pragma once
// The joint angles of a contact over EKI: taken from the controller's own latch, or interpolated in
// the recorded path, and held against each other.

#include <optional>

#include "drivers/contact.h"
#include "drivers/kuka/eki/eki_config.h"
#include "drivers/kuka/moves/cause.h"
#include "drivers/kuka/moves/position_record.h"

namespace cellcal::drivers {

struct EkiLatchResult {
  std::optional<Latch> latch;
  Cause cause;  ///< why there is none
};

struct EkiTouch {
  ContactEvent contact;                   ///< the sensor's
  std::optional<AxisAngles> latched_rad;  ///< $AXIS_INT of this very move
  AxisAngles settled_rad;
  TimePoint stopped_at{};  ///< when the state that said so arrived
};

/// `now` dates what is wrong. A latch must fit the measured path at the sensor's time stamp; its
/// delay is taken off at the speed that the arm had before the contact.
EkiLatchResult latch_of(const EkiTouch& touch, const EkiConfig& config,
                        const PositionRecord& record, TimePoint now);

}  // namespace cellcal::drivers
