#pragma once
// Time spent in each activity of a session, from its changes of phase.

#include <array>
#include <span>

#include "daemon/session/phase.h"

namespace cellcal::daemon {

/// Activity of a session; every phase under way belongs to one.
enum class Activity {
  kMoving,      ///< transits, retreats, the way back
  kFastSearch,  ///< to the contact
  kConfirming,  ///< back-offs and slow searches
  kArming,
  kRecording,
  kChoosing,
  kProving,
  kOther,  ///< once per session: connecting, planning, identifying
};

inline constexpr std::array kAllActivities{
    Activity::kMoving,    Activity::kFastSearch, Activity::kConfirming, Activity::kArming,
    Activity::kRecording, Activity::kChoosing,   Activity::kProving,    Activity::kOther};

const char* to_string(Activity activity);
/// The parameter that dominates the duration.
const char* driver_of(Activity activity);
Activity activity_of(Phase phase);

struct ActivityTime {
  int count = 0;  ///< consecutive phases of one activity count once
  double total_s = 0.0, worst_s = 0.0;
};

struct PhaseTimes {
  std::array<ActivityTime, kAllActivities.size()> of{};  ///< indexed by Activity
  int touches = 0;                                       ///< recorded
  int interruptions = 0;  ///< harmless interruptions followed by a wait for the links
  double total_s = 0.0;
  const ActivityTime& operator[](Activity a) const { return of[static_cast<std::size_t>(a)]; }
};

struct TimedChange {
  double clock_s = 0.0;  ///< session's clock
  PhaseChange change;
};

/// The time between an end, or a killed daemon, and the resumption is not counted.
PhaseTimes phase_times(std::span<const TimedChange> changes);

}  // namespace cellcal::daemon
