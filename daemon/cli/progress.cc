#include "daemon/cli/progress.h"

#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace cellcal::daemon {

namespace {

constexpr std::size_t kBar = 24;
constexpr std::size_t kUsualWidth = 80;
constexpr std::size_t kLongestLine = 200;

std::string time_words(double seconds) {
  const auto whole = static_cast<long>(std::lround(std::max(0.0, seconds)));
  if (whole < 60) return fmt::format("{} s left", whole);
  return fmt::format("{} min {:02} s left", whole / 60, whole % 60);
}

std::size_t terminal_width() {
  winsize size{};
  const bool known = ::ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0;
  return known ? size.ws_col : kUsualWidth;
}

}  // namespace

std::string progress_line(const Progress& progress, std::size_t width) {
  const double part = progress.total == 0
                          ? 0.0
                          : static_cast<double>(std::min(progress.done, progress.total)) /
                                static_cast<double>(progress.total);
  const auto full = static_cast<std::size_t>(part * kBar);
  std::string line = "[" + std::string(full, '#') + std::string(kBar - full, '.') + "]";
  if (progress.total > 0) line += fmt::format(" {}/{}", progress.done, progress.total);
  if (!progress.target.empty()) line += " " + progress.target;
  line += " " + progress.phase;
  if (progress.u95_mm && progress.goal_mm)
    line += fmt::format("  u95 {:.3f} mm (goal {:.3f} mm)", *progress.u95_mm, *progress.goal_mm);
  if (progress.residual_mm) line += fmt::format("  residual {:.3f} mm", *progress.residual_mm);
  if (progress.time_left_s) line += "  " + time_words(*progress.time_left_s);
  if (line.size() > width) line.resize(width);
  return line;
}

ProgressDisplay::ProgressDisplay(bool lines)
    : terminal_(::isatty(STDERR_FILENO) == 1), lines_(lines && !terminal_) {}

void ProgressDisplay::show(const Progress& progress) {
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
  std::fprintf(stderr, "\r\033[K%s", progress_line(progress, terminal_width() - 1).c_str());
  std::fflush(stderr);
  shown_ = true;
}

void ProgressDisplay::say(const std::string& line) {
  if ((!terminal_ && !lines_) || line == said_) return;
  clear();
  std::fprintf(stderr, "%s\n", line.c_str());
  said_ = line;
}

void ProgressDisplay::clear() {
  if (!shown_) return;
  std::fputs("\r\033[K", stderr);
  std::fflush(stderr);
  shown_ = false;
}

}  // namespace cellcal::daemon
