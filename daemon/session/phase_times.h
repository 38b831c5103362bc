#pragma once
// Time spent by a session per activity, from the phase changes in its log.

#include <array>
#include <span>
#include <string>
#include <string_view>

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

/// `events`: "TIME WORDS" as returned by Journal::events(). The gap between an end (or a killed daemon) and
/// the resume is not counted. Events without a phase change or a time are ignored.
PhaseTimes phase_times(std::span<const std::string> events);

}  // namespace cellcal::daemon
