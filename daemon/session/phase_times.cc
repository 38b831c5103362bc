#include "daemon/session/phase_times.h"

#include <algorithm>
#include <optional>

#include "calib/model/iso_time.h"
#include "daemon/session/phase_change.h"

namespace cellcal::daemon {

namespace {

struct Timed {
  double at_s;
  PhaseChange change;
};

std::optional<Timed> timed(std::string_view event) {
  const std::size_t gap = event.find(' ');
  if (gap == event.npos) return std::nullopt;
  const auto at_s = calib::seconds_of(event.substr(0, gap));
  const auto change = phase_change_in(event.substr(gap + 1));
  if (!at_s || !change) return std::nullopt;
  return Timed{*at_s, *change};
}

/// Consecutive phases of one activity.
class Stay {
 public:
  void go_on(PhaseTimes& times, Activity activity, double took_s) {
    ActivityTime& time = times.of[static_cast<std::size_t>(activity)];
    if (!began_ || activity != activity_) {
      *this = {};
      ++time.count;
    }
    began_ = true;
    activity_ = activity;
    so_far_s_ += took_s;
    time.total_s += took_s;
    time.worst_s = std::max(time.worst_s, so_far_s_);
    times.total_s += took_s;
  }

 private:
  bool began_ = false;
  Activity activity_ = Activity::kOther;
  double so_far_s_ = 0.0;
};

bool under_way(Phase phase) { return phase != Phase::kIdle && !is_final(phase); }

}  // namespace

const char* to_string(Activity activity) {
  switch (activity) {
    case Activity::kMoving:
      return "transit and retreat";
    case Activity::kFastSearch:
      return "fast search";
    case Activity::kConfirming:
      return "back-off, slow search";
    case Activity::kArming:
      return "arming";
    case Activity::kRecording:
      return "recording";
    case Activity::kChoosing:
      return "choosing";
    case Activity::kProving:
      return "proving";
    case Activity::kOther:
      break;
  }
  return "other";
}

const char* driver_of(Activity activity) {
  switch (activity) {
    case Activity::kMoving:
      return "axis limits";
    case Activity::kFastSearch:
      return "search speed, approach";
    case Activity::kConfirming:
      return "confirmations";
    case Activity::kArming:
      return "serial line";
    case Activity::kRecording:
      return "disk";
    case Activity::kChoosing:
      return "processor";
    case Activity::kProving:
      return "self-test";
    case Activity::kOther:
      break;
  }
  return "links, plan, estimate";
}

Activity activity_of(Phase phase) {
  switch (phase) {
    case Phase::kFreeing:
    case Phase::kTransit:
    case Phase::kRetreat:
    case Phase::kReturning:
      return Activity::kMoving;
    case Phase::kFastSearch:
      return Activity::kFastSearch;
    case Phase::kBackingOff:
    case Phase::kSlowSearch:
      return Activity::kConfirming;
    case Phase::kArmingFast:
    case Phase::kArmingSlow:
      return Activity::kArming;
    case Phase::kRecording:
      return Activity::kRecording;
    case Phase::kChoosing:
      return Activity::kChoosing;
    case Phase::kProving:
      return Activity::kProving;
    default:
      return Activity::kOther;
  }
}

PhaseTimes phase_times(std::span<const std::string> events) {
  PhaseTimes times;
  std::optional<Timed> last;
  Stay stay;
  for (const std::string& event : events) {
    const auto now = timed(event);
    if (!now) continue;
    const Phase phase = now->change.from;
    if (last && under_way(phase) && last->change.to == phase) {
      stay.go_on(times, activity_of(phase),
                 std::max(0.0, now->at_s - last->at_s));  // the wall clock may have been set
      // After watching it returns to the same wait.
      times.interruptions +=
          now->change.to == Phase::kRecovering && phase != Phase::kWatching ? 1 : 0;
      times.touches += phase == Phase::kRecording && !is_final(now->change.to) ? 1 : 0;
    } else {
      stay = {};
    }
    last = now;
  }
  return times;
}

}  // namespace cellcal::daemon
