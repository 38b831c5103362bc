#include "daemon/cli/progress.h"

#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <sstream>

#include "daemon/cli/commands.h"

namespace cellcal::daemon {

namespace {

constexpr std::size_t kBar = 24;
constexpr std::size_t kUsualWidth = 80;
constexpr std::size_t kLongestLine = 200;

std::string time_words(double seconds) {
  const auto whole = static_cast<long>(std::lround(std::max(0.0, seconds)));
  return say({whole < 60 ? "say.cli.progress.left.s" : "say.cli.progress.left",
              {{"min", whole / 60}, {"s", whole % 60}}});
}

std::size_t terminal_width() {
  winsize size{};
  const bool known = ::ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0;
  return known ? size.ws_col : kUsualWidth;
}

/// The first of the three that is set takes precedence, as in setlocale(3).
bool terminal_has_utf8() {
  for (const char* name : {"LC_ALL", "LC_CTYPE", "LANG"}) {
    const char* set = std::getenv(name);
    if (set == nullptr || *set == '\0') continue;
    const std::string locale = set;
    return locale.find("UTF-8") != std::string::npos || locale.find("utf8") != std::string::npos;
  }
  return false;
}

double part(double whole, std::int64_t of) {
  return of > 0 ? whole / static_cast<double>(of) : 0.0;
}

/// The daemon's own word where this program's catalogue has none.
std::string word(const char* kind, const std::string& name) {
  const std::string id = kind + name;
  return calib::sentence_of(id) ? say(id) : name;
}

}  // namespace

std::string progress_line(const Progress& progress, std::size_t width) {
  const double part = progress.share ? std::clamp(*progress.share, 0.0, 1.0)
                      : progress.total == 0
                          ? 0.0
                          : static_cast<double>(std::min(progress.done, progress.total)) /
                                static_cast<double>(progress.total);
  const auto full = static_cast<std::size_t>(part * kBar);
  std::string line = "[" + std::string(full, '#') + std::string(kBar - full, '.') + "]";
  if (progress.total > 0) line += fmt::format(" {}/{}", progress.done, progress.total);
  if (!progress.target.empty()) line += " " + progress.target;
  line += " " + progress.phase;
  if (progress.share) line += fmt::format(" {:.0f} %", 100.0 * part);
  if (progress.u95_mm && progress.goal_mm)
    line += "  " +
            say({"say.cli.progress.u95", {{"mm", *progress.u95_mm}, {"goal", *progress.goal_mm}}});
  if (progress.residual_mm)
    line += "  " + say({"say.cli.progress.residual", {{"mm", *progress.residual_mm}}});
  if (progress.time_left_s) line += "  " + time_words(*progress.time_left_s);
  if (line.size() > width) line.resize(width);
  return line;
}

std::string sparkline(std::span<const double> values, std::size_t width, bool utf8) {
  constexpr std::array kBlocks{"\u2581", "\u2582", "\u2583", "\u2584",
                               "\u2585", "\u2586", "\u2587", "\u2588"};
  constexpr std::array kLetters{"_", ".", "-", "=", "+", "*", "#", "@"};
  const auto newest = values.last(std::min(values.size(), width));
  double largest = 0.0;
  for (const double value : newest) largest = std::max(largest, value);
  std::string text;
  for (const double value : newest) {
    const double part = largest > 0.0 ? std::clamp(value / largest, 0.0, 1.0) : 0.0;
    const auto height = static_cast<std::size_t>(std::lround(part * (kBlocks.size() - 1)));
    text += (utf8 ? kBlocks : kLetters)[height];
  }
  return text;
}

std::vector<std::string> view_lines(const Progress& progress, std::span<const double> residuals_mm,
                                    std::size_t width, bool utf8) {
  std::vector<std::string> lines{progress_line(progress, width)};
  if (!residuals_mm.empty()) {
    const double worst = *std::max_element(residuals_mm.begin(), residuals_mm.end());
    const std::string words = say({"say.cli.progress.residuals", {{"mm", worst}}}) + "  ";
    if (words.size() < width)
      lines.push_back(words + sparkline(residuals_mm, width - words.size(), utf8));
  }
  std::istringstream links(progress.links);
  for (std::string line; std::getline(links, line);) lines.push_back(line.substr(0, width));
  return lines;
}

ProgressDisplay::ProgressDisplay(Shows shows)
    : terminal_(::isatty(STDERR_FILENO) == 1),
      lines_(shows != Shows::kLine && !terminal_),
      view_(shows == Shows::kView) {}

void ProgressDisplay::rewrite(const std::vector<std::string>& lines) {
  clear();
  for (std::size_t i = 0; i < lines.size(); ++i)
    std::fprintf(stderr, "%s%s", i == 0 ? "" : "\n", lines[i].c_str());
  std::fflush(stderr);
  shown_ = lines.size();
}

void ProgressDisplay::show(const Progress& progress) {
  if (progress.residual_mm && progress.done > last_done_) {
    residuals_mm_.push_back(*progress.residual_mm);
    last_done_ = progress.done;
  }
  if (lines_) {
    constexpr std::chrono::seconds kBetween{10};
    const auto now = std::chrono::steady_clock::now();
    if (now < next_line_) return;
    next_line_ = now + kBetween;
    std::fprintf(stderr, "%s\n", progress_line(progress, kLongestLine).c_str());
    return;
  }
  if (!terminal_) return;
  // One column stays free: a full line would wrap.
  const std::size_t width = terminal_width() - 1;
  rewrite(view_ ? view_lines(progress, residuals_mm_, width, terminal_has_utf8())
                : std::vector{progress_line(progress, width)});
}

void ProgressDisplay::say(const std::string& line) {
  if ((!terminal_ && !lines_) || line == said_) return;
  clear();
  std::fprintf(stderr, "%s\n", line.c_str());
  said_ = line;
}

void ProgressDisplay::clear() {
  if (shown_ == 0) return;
  if (shown_ > 1) std::fprintf(stderr, "\033[%zuA", shown_ - 1);
  std::fputs("\r\033[J", stderr);
  std::fflush(stderr);
  shown_ = 0;
}

std::string times_words(std::int64_t touches, std::span<const ActivityRow> rows) {
  std::vector<ActivityRow> sorted(rows.begin(), rows.end());
  std::erase_if(sorted, [](const ActivityRow& row) { return row.count == 0; });
  std::stable_sort(sorted.begin(), sorted.end(), [](const ActivityRow& a, const ActivityRow& b) {
    return a.total_s > b.total_s;
  });
  double total_s = 0.0;
  for (const ActivityRow& row : sorted) total_s += row.total_s;
  std::string text = said("say.cli.times.head");
  for (const ActivityRow& row : sorted)
    text += said({"say.cli.times.row",
                  {{"activity", fmt::format("{:<22}", word("say.activity.", row.activity))},
                   {"each", part(row.total_s, touches)},
                   {"count", row.count},
                   {"mean", part(row.total_s, row.count)},
                   {"worst", row.worst_s},
                   {"total", row.total_s},
                   {"share", total_s > 0.0 ? 100.0 * row.total_s / total_s : 0.0},
                   {"driver", word("say.driver.", row.driver)}}});
  return text + said({"say.cli.times.all",
                      {{"each", part(total_s, touches)}, {"count", touches}, {"total", total_s}}});
}

}  // namespace cellcal::daemon
