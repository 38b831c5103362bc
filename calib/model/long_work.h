#pragma once
// Cancellation and progress of computations that take seconds.
//
// The caller keeps a Watch during the call; the computation, on the same thread, polls in its loops. After
// cancellation the poll throws Cancelled: nothing is returned, and an object in the middle of a computation must not
// be used further. Without a Watch a poll has no effect. Results never depend on polls.

#include <exception>
#include <functional>

namespace cellcal::calib {

/// Thrown by a cancelled computation. Carries no result and is not a failure.
struct Cancelled : std::exception {
  const char* what() const noexcept override { return "called off"; }
};

/// Phase of a plan.
enum class PlanStep {
  kReach,   ///< touches within reach
  kChoose,  ///< most informative touches
  kWays     ///< clear paths between them, and their order
};

/// Progress of a computation.
struct WorkDone {
  PlanStep step = PlanStep::kReach;
  double share = 0.0;  ///< of the whole, 0 to 1; never decreases

  bool operator==(const WorkDone&) const = default;
};

/// Watches the computations called by the constructing thread during its lifetime. The innermost
/// one applies.
class Watch {
 public:
  /// `cancelled` is called often and on any computing thread; once true it stays true. `report` is called on the
  /// caller's thread, at each percent.
  explicit Watch(std::function<bool()> cancelled, std::function<void(const WorkDone&)> report = {});
  ~Watch();
  Watch(const Watch&) = delete;
  Watch& operator=(const Watch&) = delete;

  /// Watch of the calling thread; null if there is none.
  static const Watch* current_watch();
  bool cancelled() const { return cancelled_(); }

 private:
  friend class HelperScope;
  friend class Part;
  friend void report_progress(double share);

  std::function<bool()> cancelled_;
  std::function<void(const WorkDone&)> report_;
  const Watch* outer_;
};

/// Makes a helping thread use the watch of the thread that it helps.
class HelperScope {
 public:
  explicit HelperScope(const Watch* current_watch);
  ~HelperScope();
  HelperScope(const HelperScope&) = delete;
  HelperScope& operator=(const HelperScope&) = delete;
};

/// Throws Cancelled if the caller cancelled.
void poll_cancelled();
/// Non-throwing variant, for callbacks of libraries that do not allow exceptions.
bool is_cancelled();

/// A part of the computation: a range of shares of the enclosing part.
class Part {
 public:
  Part(PlanStep step, double from, double to);
  ~Part();
  Part(const Part&) = delete;
  Part& operator=(const Part&) = delete;

 private:
  double from_, to_;
  PlanStep step_;
};

/// Reports progress within the current part.
void report_progress(double share);

}  // namespace cellcal::calib
