#pragma once
// The numbers of one touch and of a session's timeouts, each with its reason.

#include <chrono>
#include <string>

namespace cellcal::daemon {

struct TouchPolicy {
  /// 10 mm/s and 20 ms of reaction are 0.2 mm of overtravel: harmless to the tip. The latch is then
  /// wrong by 2 um, where one touch scatters by 30 and gears by 100.
  double fast_m_s = 0.010;
  /// Of the searches that confirm a contact. At 4 mm/s a stamp that is 1 ms wrong moves it by 4 um, and
  /// the delay of the contacts, seen between this speed and the fast one, is known to 0.4 ms.
  double slow_m_s = 0.004;
  /// One fast contact makes a touch. Every so many touches it is confirmed by slow searches all the
  /// same, so that noise and delay of the contacts stay measured: with 8, a hundred touches have
  /// twelve. 1: every touch.
  int confirm_every = 8;
  /// So is a contact that surprises: by more than this from where the touches so far expect it, ...
  double surprise_sigmas = 5.0;
  /// ... after noise in the same search, by more bounces than a sound contact of metal makes, ...
  int most_bounces = 10;
  /// ... or by a time stamp that leaves more of the place open than this, a third of the noise of
  /// one touch. And the first contact of each target, which nothing foretells.
  double most_stamp_m = 0.00001;
  /// From the contact of the fast search: out of contact again (0.2 mm of overtravel, bending), and
  /// at constant speed by the time of the next.
  double back_off_m = 0.0010;
  /// From that of a slow search, whose overtravel is below 0.15 mm. At 4 mm/s every millimetre costs a
  /// quarter of a second.
  double slow_back_off_m = 0.0006;
  /// A slow search ends so far behind the first contact.
  double beyond_first_m = 0.003;
  /// A search begins nearer than at the stand-off where the touches so far tell where the contact
  /// will be: by so many sigmas and a margin before it, and no nearer than at the least.
  double approach_sigmas = 6.0, approach_margin_m = 0.001, approach_least_m = 0.002;
  /// It begins no further behind where the nominal arm would be in contact: an arm is 3 mm off as it
  /// is delivered, and a forecast that says much more says that something else is wrong.
  double behind_nominal_m = 0.005;
  /// Contact within this much travel from the stand-off is not the sphere: the tip would have been
  /// 11 mm early at the default stand-off of 12 mm. Jogged spheres, cables and chips are. One that
  /// is early for what was expected only is a surprise, and is confirmed.
  double earliest_m = 0.001;
  /// Slow readings that must agree where a touch is confirmed ...
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

/// What the way in which the arm is stopped permits of it.
struct SearchLimits {
  double fastest_m_s = 0.050;
  int most_confirm_every = 1000;
  std::string because{};  ///< for messages; empty: the usual ones
};

/// How often a session goes on by itself where this computer was late (interruption.h): by default, since
/// robot and sensor were sound and prove it again each time. Each repeat is as safe as the first; what the
/// bounds are for is a computer that is never quiet. Beside four busy loops, compilers and a syncing disk
/// some two touches in five are stopped.
struct BusyRepeats {
  int of_touch = 30;     ///< two minutes of one touch; behind as many stops in a row all would be stopped
  int of_session = 400;  ///< four for each of a hundred touches
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
  /// Likewise where this computer was late: a busy spell ends by itself, and nothing moves meanwhile.
  std::chrono::milliseconds busy{std::chrono::minutes(1)};
  /// So long both are then watched: 500 cycles of 4 ms without another gap or late reply.
  std::chrono::milliseconds watching{std::chrono::seconds(2)};
  std::chrono::milliseconds stopping{std::chrono::seconds(5)};
  std::chrono::milliseconds identifying{std::chrono::minutes(5)};
  std::chrono::milliseconds reporting{std::chrono::minutes(1)};
};

}  // namespace cellcal::daemon
