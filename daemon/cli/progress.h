#pragma once
// Progress display on a terminal.

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
  std::string links{};                        ///< link quality, one line each
  std::optional<double> share{};              ///< of an activity without touches, 0 to 1
};

/// "[######....] 12/50 S2 slow search  residual 0.034 mm  3 min 20 s left", at most `width` columns. With a
/// goal "u95 0.231 to 0.150 mm" precedes the residual.
std::string progress_line(const Progress& progress, std::size_t width);

/// One character per value, the newest at most `width`, in eight heights from 0 to the maximum: block
/// elements on UTF-8 terminals, otherwise "_.-=+*#@".
std::string sparkline(std::span<const double> values, std::size_t width, bool utf8);

/// Progress line, residuals of the touches so far, and links, as shown by 'cellcal watch'.
std::vector<std::string> view_lines(const Progress& progress, std::span<const double> residuals_mm,
                                    std::size_t width, bool utf8);

enum class Shows {
  kLine,            ///< one line on a terminal, otherwise nothing
  kLinesElsewhere,  ///< one line on a terminal, otherwise a line at once and every ten seconds
  kView             ///< the view on a terminal, otherwise as kLinesElsewhere
};

/// Display on standard error that is rewritten during its lifetime.
class ProgressDisplay {
 public:
  explicit ProgressDisplay(Shows shows = Shows::kLine);
  ~ProgressDisplay() { clear(); }
  ProgressDisplay(const ProgressDisplay&) = delete;
  ProgressDisplay& operator=(const ProgressDisplay&) = delete;

  void show(const Progress& progress);
  /// Prints a permanent line above the display; repetitions are suppressed.
  void say(const std::string& line);
  void clear();

 private:
  void rewrite(const std::vector<std::string>& lines);

  bool terminal_, lines_, view_;
  std::size_t shown_ = 0;  ///< number of lines on the terminal
  std::vector<double> residuals_mm_;
  std::size_t last_done_ = 0;
  std::chrono::steady_clock::time_point next_line_{};
  std::string said_;
};

// Table of the time spent per activity.

struct ActivityRow {
  std::string activity, driver;
  std::int64_t count = 0;
  double total_s = 0.0, worst_s = 0.0;
};

/// One row per activity, the largest first: seconds per touch, count, mean and maximum, total, share, and the
/// dominant parameter. Ends with a line break.
std::string times_words(std::int64_t touches, std::span<const ActivityRow> rows);

}  // namespace cellcal::daemon
