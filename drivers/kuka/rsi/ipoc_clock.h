#pragma once
// Position of the arm at an instant of this computer's clock, from packets stamped with IPOC, and
// its uncertainty.
//
// Two models; if IPOC counts milliseconds, the record itself determines which one holds:
//
//   - A clock that keeps time (every real controller): a packet arrives with a delay that is never
//     negative and small at least once in half a second, so that the earliest arrivals determine the
//     map, unaffected by late ones. The spread of the earliest arrivals of the quarters of the record
//     is the map's uncertainty. A network that becomes slower is one step between two quarters.
//   - By arrival: for peers that count packets, or whose milliseconds are not real time (a program
//     that sleeps from packet to packet lags in every quarter). Packet n belongs to the instant of
//     its arrival, without extrapolation. Motion between two packets may be uniform or a single jump:
//     the uncertainty is the longest of the intervals around the instant, over the root of three.
//
// In both models a later packet belongs to a later instant, and no packet is outside the record.

#include <optional>

#include "drivers/kuka/moves/position_record.h"

namespace cellcal::drivers {

struct IpocClock {
  double seconds_per_count = 0.0;
  bool milliseconds = false;  ///< the peer's counter is declared to be milliseconds
};

struct AnglesAt {
  AxisAngles actual_rad;
  double time_sigma_s = 0.0;  ///< of the map from IPOC to this computer's clock, 1 sigma
};

/// Empty if t is outside the record. Neither allocates nor throws.
std::optional<AnglesAt> angles_at(const PositionRecord& record, TimePoint t,
                                  const IpocClock& clock);

}  // namespace cellcal::drivers
