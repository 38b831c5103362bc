#pragma once
// Phases of a session, and sets of them for the rows of the table.

#include <array>
#include <concepts>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include "calib/model/enum_table.h"

namespace cellcal::daemon {

enum class Phase : std::uint8_t {
  kIdle,         ///< nothing requested yet
  kPlanning,     ///< worker computes the touches; devices still closed
  kConnecting,   ///< robot and contact sensor opened; waiting until both are ready
  kReferencing,  ///< the arm's actual position becomes the starting point
  kRouting,      ///< worker searches for a clear path from the arm's position
  kFreeing,      ///< resumed in contact: the first waypoint leads out of it
  kProving,      ///< out of contact again: self-test of the sensor before any other move
  kTransit,      ///< waypoint by waypoint to the stand-off
  kArmingFast,
  kFastSearch,
  kBackingOff,
  kArmingSlow,
  kSlowSearch,  ///< its reading is used
  kRecording,   ///< touch being written to disk, arm at rest at the contact
  kRetreat,     ///< to the clear point
  kChoosing,    ///< worker chooses the next touch from the results so far
  kReturning,   ///< from the last clear point back to the plan's start
  kIdentifying,
  kReporting,
  kRecovering,        ///< harmlessly interrupted, arm at rest: waits for both links
  kWatchingTheLinks,  ///< links are up: observed for a while, self-test of the sensor; no motion yet
  kStopping,          ///< stop commanded, waiting for rest
  kDone,
  kAborted,
  kFailed,
};

inline constexpr auto kAllPhases = all_values<Phase>();

/// "fast search"
constexpr const char* to_string(Phase phase) { return own_name<' '>(phase); }
/// Inverse of to_string(); none for an unknown name.
constexpr std::optional<Phase> phase_of(std::string_view name) {
  return by_own_name<Phase, ' '>(name);
}

struct PhaseChange {
  Phase from = Phase::kIdle, to = Phase::kIdle;
  bool operator==(const PhaseChange&) const = default;
};

/// A set of phases, as one row of the table names it.
class Phases {
 public:
  template <typename... P>
  requires(std::same_as<P, Phase>&&...) constexpr explicit(false) Phases(P... phases)
      : bits_((bit(phases) | ... | 0u)) {}
  constexpr bool has(Phase phase) const { return (bits_ & bit(phase)) != 0; }
  constexpr Phases operator|(Phases other) const {
    Phases result;
    result.bits_ = bits_ | other.bits_;
    return result;
  }

 private:
  static constexpr std::uint32_t bit(Phase phase) { return 1u << static_cast<unsigned>(phase); }
  std::uint32_t bits_ = 0;
};

/// A move is under way or requested.
inline constexpr Phases kMovingPhases{Phase::kFreeing,    Phase::kTransit,    Phase::kFastSearch,
                                      Phase::kBackingOff, Phase::kSlowSearch, Phase::kRetreat,
                                      Phase::kReturning};
/// Devices are open and the arm is at rest.
inline constexpr Phases kStandingPhases{Phase::kReferencing, Phase::kRouting,    Phase::kProving,
                                        Phase::kArmingFast,  Phase::kArmingSlow, Phase::kRecording,
                                        Phase::kChoosing};
/// Devices are open, the arm is at rest, and a link may be down.
inline constexpr Phases kAwaitingPhases{Phase::kConnecting, Phase::kRecovering,
                                        Phase::kWatchingTheLinks};
/// No device is open.
inline constexpr Phases kThinkingPhases{Phase::kPlanning, Phase::kIdentifying, Phase::kReporting};
inline constexpr Phases kFinalPhases{Phase::kDone, Phase::kAborted, Phase::kFailed};
/// A session is under way.
inline constexpr Phases kActivePhases =
    kMovingPhases | kStandingPhases | kThinkingPhases | kAwaitingPhases;

inline bool is_final(Phase phase) { return kFinalPhases.has(phase); }

// Time spent in each activity of a session, from its changes of phase.

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

inline constexpr auto kAllActivities = all_values<Activity>();

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
