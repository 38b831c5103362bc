#pragma once
// Parameters of one touch and timeouts of a session, each with its reason.

#include <chrono>
#include <string>

namespace cellcal::daemon {

struct TouchPolicy {
  /// 10 mm/s and 20 ms of reaction give 0.2 mm of overtravel, harmless to the tip. The latch error is then 2
  /// um, against a scatter of 30 um of one touch and 100 um of gears.
  double fast_m_s = 0.010;
  /// Speed of the confirming searches. At 4 mm/s a stamp error of 1 ms gives 4 um, and the contact delay,
  /// seen between this speed and the fast one, is known to 0.4 ms.
  double slow_m_s = 0.004;
  /// One fast contact makes a touch. Every n-th touch is confirmed by slow searches, so that noise and delay
  /// of the contacts stay measured: with 8, a hundred touches give twelve. 1: every touch.
  int confirm_every = 8;
  /// A surprising contact is confirmed as well: one this many sigmas from the expected position, ...
  double surprise_sigmas = 5.0;
  /// ... or after more bounces in the same search than a sound metal contact makes, ...
  int most_bounces = 10;
  /// ... or with a time stamp that leaves the position uncertain by more than this, a third of the noise of
  /// one touch. The first contact of each target, which has no expectation, is confirmed too.
  double most_stamp_m = 0.00001;
  /// Back-off from the contact of the fast search: leaves the contact (0.2 mm of overtravel, bending) and
  /// reaches constant speed before the next.
  double back_off_m = 0.0010;
  /// Back-off from a slow search, whose overtravel is below 0.15 mm. At 4 mm/s every millimetre costs 0.25 s.
  double slow_back_off_m = 0.0006;
  /// End of a slow search beyond the first contact.
  double beyond_first_m = 0.003;
  /// With an expected contact a search begins nearer than the stand-off: before the expected position by this
  /// many sigmas plus a margin, and by at least the minimum.
  double approach_sigmas = 6.0, approach_margin_m = 0.001, approach_least_m = 0.002;
  /// Limit beyond the nominal contact for the start of a search: an arm is off by 3 mm as delivered, and a
  /// larger expectation indicates another error.
  double behind_nominal_m = 0.005;
  /// A contact within this travel from the stand-off is not the sphere: the tip would be 11 mm early at the
  /// default stand-off of 12 mm. Causes are displaced spheres, cables and chips. A contact that is early only
  /// against its expectation is a surprise, and is confirmed.
  double earliest_m = 0.001;
  /// Slow readings that must agree in a confirmed touch ...
  int readings = 2;
  /// ... within this distance along the search line: twice the 0.03 mm of a single touch.
  double tolerance_m = 0.00006;
  /// Slow searches before the touch is given up.
  int max_readings = 5;
  /// Trips caused by noise, per touch, before the touch is given up.
  int max_revoked = 5;
  /// Touches chosen one by one that fail (no contact, disagreeing readings, noise) are replaced by others.
  /// Limit of consecutive failures ...
  int max_failed_in_a_row = 2;
  /// ... and of failures in total.
  int max_failed = 8;
};

/// Limits of a search imposed by the way in which the arm is stopped.
struct SearchLimits {
  double fastest_m_s = 0.050;
  int most_confirm_every = 1000;
  std::string because{};  ///< for messages; empty: the usual reasons
};

/// Automatic repeats of a session after lateness of this computer (interruption.h). They are on by default,
/// since robot and sensor were sound and are verified each time; a repeat is as safe as the first attempt.
/// The limits serve computers that are never quiet: under four busy loops, compilers and a syncing disk about
/// two touches in five are stopped.
struct BusyRepeats {
  int of_touch = 30;     ///< two minutes of one touch; further repeats would be stopped as well
  int of_session = 400;  ///< four for each of a hundred touches
};

/// Longest duration of each phase.
struct Timeouts {
  std::chrono::milliseconds planning{std::chrono::minutes(5)};
  /// Until both links are up: the operator walks to the pendant, selects the program and starts it.
  std::chrono::milliseconds connecting{std::chrono::minutes(5)};
  /// Self-test of the sensor, and identification where needed.
  std::chrono::milliseconds proving{std::chrono::seconds(15)};
  /// Peers that wait for replies repeat once per second, then the cycle is learnt.
  std::chrono::milliseconds referencing{std::chrono::seconds(5)};
  /// One exchange over the serial line takes milliseconds.
  std::chrono::milliseconds arming{std::chrono::seconds(2)};
  /// One waypoint at the speed limits, also at 3 % override.
  std::chrono::milliseconds waypoint{std::chrono::minutes(3)};
  /// Limit of a search or back-off: this multiple of its duration at constant speed, plus slack.
  double search_factor = 3.0;
  std::chrono::milliseconds search_slack{std::chrono::seconds(10)};
  std::chrono::milliseconds recording{std::chrono::seconds(10)};
  /// Until both links are back after a harmless interruption. A controller whose session continues is back
  /// within 0.5 s; the sensor's circuit settles meanwhile.
  std::chrono::milliseconds recovering{std::chrono::seconds(3)};
  /// Likewise after lateness of this computer: a busy spell ends by itself, and nothing moves meanwhile.
  std::chrono::milliseconds busy{std::chrono::minutes(1)};
  /// Time for which both links are then observed: 500 cycles of 4 ms without another gap or late reply.
  std::chrono::milliseconds watching{std::chrono::seconds(2)};
  std::chrono::milliseconds stopping{std::chrono::seconds(5)};
  std::chrono::milliseconds identifying{std::chrono::minutes(5)};
  std::chrono::milliseconds reporting{std::chrono::minutes(1)};
};

}  // namespace cellcal::daemon
