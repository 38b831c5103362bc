#pragma once
// A computation of seconds as its caller sees it: called off in its midst, and how far it is.
//
// The caller keeps a Watch while it calls; the computation, on the same thread, polls in its loops. Where the caller
// wants no more of it, the poll throws Cancelled: nothing is returned, and an object that was computing is of no
// further use. Without a Watch a poll does nothing. No result depends on a poll.

#include <exception>
#include <functional>

namespace cellcal::calib {

/// Out of a computation that its caller has called off. Says nothing of what was computed: no failure.
struct Cancelled : std::exception {
  const char* what() const noexcept override { return "called off"; }
};

/// What a plan is at.
enum class PlanStep {
  kReach,   ///< which touches the arm reaches
  kChoose,  ///< which of them say most
  kWays     ///< clear ways between them, and their order
};

/// How far a computation is.
struct WorkDone {
  PlanStep step = PlanStep::kReach;
  double share = 0.0;  ///< of the whole, 0 to 1; never falls

  bool operator==(const WorkDone&) const = default;
};

/// Of the computations that the thread which made it calls, until it goes. The innermost counts.
class Watch {
 public:
  /// `cancelled` is asked on any thread that computes, often; once true it stays so. `tell`: on the caller's, at each
  /// percent.
  explicit Watch(std::function<bool()> cancelled, std::function<void(const WorkDone&)> tell = {});
  ~Watch();
  Watch(const Watch&) = delete;
  Watch& operator=(const Watch&) = delete;

  /// Of the calling thread; null: none.
  static const Watch* in_charge();
  bool cancelled() const { return cancelled_(); }

 private:
  friend class Helped;
  friend class Part;
  friend void tell_done(double share);

  std::function<bool()> cancelled_;
  std::function<void(const WorkDone&)> tell_;
  const Watch* outer_;
};

/// On a thread that helps another: that one's watch is its own.
class Helped {
 public:
  explicit Helped(const Watch* in_charge);
  ~Helped();
  Helped(const Helped&) = delete;
  Helped& operator=(const Helped&) = delete;
};

/// Throws Cancelled where the caller wants no more.
void poll_cancelled();
/// Whether it would: for callbacks of libraries that nothing may be thrown through.
bool is_cancelled();

/// A part of the computation, from this share of the part that it is in to that one.
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

/// This share of the part in hand is done.
void tell_done(double share);

}  // namespace cellcal::calib
