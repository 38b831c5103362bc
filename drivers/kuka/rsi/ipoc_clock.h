#pragma once
// Where the arm was at an instant of this computer's clock, by packets that are stamped with IPOC,
// and how well that is known.
//
// Two models, and where IPOC is said to be milliseconds the record itself says which one holds:
// a clock that keeps time (every real controller): a packet comes with a delay that is never
//   negative and small at least once in half a second, so the earliest arrivals fix the map, and
//   late ones do not move it. By how much the earliest of each quarter of the record differ is the
//   map's uncertainty. A network that became slower is one step between two quarters.
// by arrival: whoever counts packets, or counts milliseconds that are none (a program that sleeps
//   from packet to packet falls behind in every quarter). Packet n is of the instant when it came,
//   and nothing is extrapolated. Between two packets such an arm goes evenly or in one jump, nobody
//   knows: the uncertainty is the longest of the intervals around the instant, over the root of
//   three.
// Either way a later packet is of a later instant, and no packet farther away than the record.

#include <optional>

#include "drivers/kuka/moves/position_record.h"

namespace cellcal::drivers {

struct IpocClock {
  double seconds_per_count = 0.0;
  bool milliseconds = false;  ///< that is what the peer's counter is said to be
};

struct AnglesAt {
  AxisAngles actual_rad;
  double time_sigma_s = 0.0;  ///< of the map from IPOC to this computer's clock, 1 sigma
};

/// None if t lies outside of the record. Neither allocates nor throws.
std::optional<AnglesAt> angles_at(const PositionRecord& record, TimePoint t,
                                  const IpocClock& clock);

}  // namespace cellcal::drivers
