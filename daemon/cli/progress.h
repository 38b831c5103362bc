#pragma once
// The line that a person watches.

#include <chrono>
#include <cstddef>
#include <optional>
#include <string>

namespace cellcal::daemon {

struct Progress {
  std::string phase, target;
  std::size_t done = 0, total = 0;
  std::optional<double> residual_mm, time_left_s;
  std::optional<double> u95_mm{}, goal_mm{};  ///< of touches chosen one by one
};

/// "[######....] 12/50 S2 slow search  residual 0.034 mm  3 min 20 s left", at most `width` wide.
/// With a goal "u95 0.231 to 0.150 mm" stands before the residual.
std::string progress_line(const Progress& progress, std::size_t width);

/// Rewrites one line on standard error while it lives, if that is a terminal. Otherwise it is silent,
/// or, asked for `lines`, writes one now and one every ten seconds.
class ProgressDisplay {
 public:
  explicit ProgressDisplay(bool lines = false);
  ~ProgressDisplay() { clear(); }
  ProgressDisplay(const ProgressDisplay&) = delete;
  ProgressDisplay& operator=(const ProgressDisplay&) = delete;

  void show(const Progress& progress);
  /// One line that stays, above the one that is rewritten; the same again is not repeated.
  void say(const std::string& line);
  void clear();

 private:
  bool terminal_, lines_;
  bool shown_ = false;
  std::chrono::steady_clock::time_point next_line_{};
  std::string said_;
};

}  // namespace cellcal::daemon
