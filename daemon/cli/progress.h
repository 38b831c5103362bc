#pragma once
// The line that a person watches.

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace cellcal::daemon {

struct Progress {
  std::string phase, target;
  std::size_t done = 0, total = 0;
  std::optional<double> residual_mm, time_left_s;
  std::optional<double> u95_mm{}, goal_mm{};  ///< of touches chosen one by one
  std::string links{};                        ///< how good they are, a line each
  std::optional<double> share{};              ///< of what is done instead of touches, 0 to 1
};

/// "[######....] 12/50 S2 slow search  residual 0.034 mm  3 min 20 s left", at most `width` wide.
/// With a goal "u95 0.231 to 0.150 mm" stands before the residual.
std::string progress_line(const Progress& progress, std::size_t width);

/// A letter per value, the newest at most `width`, of eight heights from 0 to the largest of them: of
/// block elements where the terminal has UTF-8, else of "_.-=+*#@".
std::string sparkline(std::span<const double> values, std::size_t width, bool utf8);

/// The progress line, the residuals of the touches so far, and the links: what 'cellcal watch' shows.
std::vector<std::string> view_lines(const Progress& progress, std::span<const double> residuals_mm,
                                    std::size_t width, bool utf8);

enum class Shows {
  kLine,            ///< one line on a terminal, elsewhere nothing
  kLinesElsewhere,  ///< one line on a terminal, elsewhere a line now and every ten seconds
  kView             ///< the view on a terminal, elsewhere likewise
};

/// Rewrites what it shows on standard error while it lives.
class ProgressDisplay {
 public:
  explicit ProgressDisplay(Shows shows = Shows::kLine);
  ~ProgressDisplay() { clear(); }
  ProgressDisplay(const ProgressDisplay&) = delete;
  ProgressDisplay& operator=(const ProgressDisplay&) = delete;

  void show(const Progress& progress);
  /// One line that stays, above what is rewritten; the same again is not repeated.
  void say(const std::string& line);
  void clear();

 private:
  void rewrite(const std::vector<std::string>& lines);

  bool terminal_, lines_, view_;
  std::size_t shown_ = 0;  ///< lines on the terminal
  std::vector<double> residuals_mm_;
  std::size_t last_done_ = 0;
  std::chrono::steady_clock::time_point next_line_{};
  std::string said_;
};

// Where a session's time went, as a person reads it.

struct ActivityRow {
  std::string activity, driver;
  std::int64_t count = 0;
  double total_s = 0.0, worst_s = 0.0;
};

/// A row per activity that took place, the largest first: seconds per touch, how often, each and at
/// worst, in all, share, and what it hangs on. Ends with a line break.
std::string times_words(std::int64_t touches, std::span<const ActivityRow> rows);

}  // namespace cellcal::daemon
