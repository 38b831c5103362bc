#include "daemon/session/phase.h"

#include <algorithm>
#include <cmath>

#include "calib/model/enum_table.h"

namespace cellcal::daemon {

namespace {

/// Phases of one activity that follow each other.
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
  using enum Activity;
  static constexpr EnumNames<Activity> kTable{{{kMoving, "transit and retreat"},
                                               {kFastSearch, "fast search"},
                                               {kConfirming, "back-off, slow search"},
                                               {kArming, "arming"},
                                               {kRecording, "recording"},
                                               {kChoosing, "choosing"},
                                               {kProving, "proving"},
                                               {kOther, "other"}}};
  return kTable[activity];
}

const char* driver_of(Activity activity) {
  using enum Activity;
  static constexpr EnumNames<Activity> kTable{{{kMoving, "axis limits"},
                                               {kFastSearch, "search speed, approach"},
                                               {kConfirming, "confirmations"},
                                               {kArming, "serial line"},
                                               {kRecording, "disk"},
                                               {kChoosing, "processor"},
                                               {kProving, "self-test"},
                                               {kOther, "links, plan, estimate"}}};
  return kTable[activity];
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

PhaseTimes phase_times(std::span<const TimedChange> changes) {
  PhaseTimes times;
  const TimedChange* last = nullptr;
  Stay stay;
  for (const TimedChange& now : changes) {
    if (!std::isfinite(now.clock_s)) continue;
    const Phase phase = now.change.from;
    if (last != nullptr && under_way(phase) && last->change.to == phase) {
      stay.go_on(times, activity_of(phase),
                 std::max(0.0, now.clock_s - last->clock_s));  // another daemon's clock
      // From the watch it goes back to the same wait.
      times.interruptions +=
          now.change.to == Phase::kRecovering && phase != Phase::kWatching ? 1 : 0;
      times.touches += phase == Phase::kRecording && !is_final(now.change.to) ? 1 : 0;
    } else {
      stay = {};
    }
    last = &now;
  }
  return times;
}

}  // namespace cellcal::daemon
