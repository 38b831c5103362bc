#pragma once
// The numbers of one touch and of a session's timeouts, each with its reason.

#include <chrono>

namespace cellcal::daemon {

struct TouchPolicy {
  /// First contact. 10 mm/s and 20 ms of reaction are 0.2 mm of overtravel: harmless to the tip.
  double fast_m_s = 0.010;
  /// The search that counts (method, section 7: 1-2 mm/s). At 2 mm/s a stamp that is 1 ms wrong
  /// moves the touch by 2 um.
  double slow_m_s = 0.002;
  /// From the contact of the fast search: out of contact again (0.2 mm of overtravel, bending), and
  /// at constant speed by the time of the next.
  double back_off_m = 0.0010;
  /// From that of a slow search, whose overtravel is below 0.1 mm. At 2 mm/s every millimetre costs
  /// half a second of each touch.
  double slow_back_off_m = 0.0006;
  /// A slow search ends so far behind the first contact.
  double beyond_first_m = 0.003;
  /// Contact within this much travel from the stand-off is not the sphere: the tip would have been
  /// 11 mm early at the default stand-off of 12 mm. Jogged spheres, cables and chips are.
  double earliest_m = 0.001;
  /// Readings that must agree for a touch ...
  int readings = 2;
  /// ... within this distance along the search line: twice the 0.03 mm of a single touch.
  double tolerance_m = 0.00006;
  /// Slow searches before the touch is given up.
  int max_readings = 5;
  /// Trips that turned out to be noise, per touch, before the touch is given up.
  int max_revoked = 5;
  /// Touches chosen one by one that could not be made (no contact, readings that disagree, noise)
  /// are replaced by others. So many one after the other are no accident any more ...
  int max_failed_in_a_row = 2;
  /// ... nor are so many in all.
  int max_failed = 8;
};

/// How long a phase may take before silence counts as failure.
struct Timeouts {
  std::chrono::milliseconds planning{std::chrono::minutes(5)};
  /// Until both links are up: somebody walks to the pendant, selects the program and starts it.
  std::chrono::milliseconds connecting{std::chrono::minutes(5)};
  /// Sensor self-tested, and identified anew where it has to be.
  std::chrono::milliseconds proving{std::chrono::seconds(15)};
  /// Peers that wait for replies repeat themselves once in a second, then the cycle is learnt.
  std::chrono::milliseconds referencing{std::chrono::seconds(5)};
  /// One exchange over the serial line takes milliseconds.
  std::chrono::milliseconds arming{std::chrono::seconds(2)};
  /// One waypoint at the speed limits, also at 3 % override.
  std::chrono::milliseconds waypoint{std::chrono::minutes(3)};
  /// A search or back-off may take this many times its duration at constant speed, plus slack.
  double search_factor = 3.0;
  std::chrono::milliseconds search_slack{std::chrono::seconds(10)};
  std::chrono::milliseconds recording{std::chrono::seconds(10)};
  /// Until both links are back after a harmless interruption. A controller whose session goes on is
  /// back within half a second; the sensor's circuit settles meanwhile.
  std::chrono::milliseconds recovering{std::chrono::seconds(3)};
  /// So long both are then watched: 500 cycles of 4 ms without another gap or late reply.
  std::chrono::milliseconds watching{std::chrono::seconds(2)};
  std::chrono::milliseconds stopping{std::chrono::seconds(5)};
  std::chrono::milliseconds identifying{std::chrono::minutes(5)};
  std::chrono::milliseconds reporting{std::chrono::minutes(1)};
};

}  // namespace cellcal::daemon
