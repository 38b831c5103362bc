// Duration of planning for the demo's cell, and latency of its cancellation. Prints seconds of one core; no
// threshold.

#include <fmt/format.h>

#include <algorithm>
#include <ctime>

#include "calib/files/files.h"
#include "calib/model/long_work.h"
#include "calib/plan/plan.h"
#include "tests/command_line/command_line.h"

namespace {

using namespace cellcal::calib;  // NOLINT: a benchmark's own file

/// CPU time of this thread, so that other load does not count.
double core_s() {
  timespec now{};
  ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

void measure(const Cell& cell, int touches, int check) {
  PlanOptions options;
  options.fit_touches = touches;
  options.check_touches = check;
  const double begin_s = core_s();
  const Plan plan = make_plan(cell, options);
  const double took_s = core_s() - begin_s;
  // Again with a cancellable watch, to measure the longest interval between its polls.
  long polls = 0;
  double last_s = core_s(), longest_s = 0.0;
  const Watch watch([&] {
    const double now_s = core_s();
    longest_s = std::max(longest_s, now_s - last_s);
    last_s = now_s;
    ++polls;
    return false;
  });
  (void)make_plan(cell, options);
  fmt::print(
      "{:4d} + {:2d} touches: {:5.2f} s of one core; called off within {:4.1f} ms ({} polls)\n",
      touches, check, took_s, 1e3 * std::max(longest_s, core_s() - last_s), polls);
}

}  // namespace

int main(int argc, char** argv) {
  cellcal::CommandLine app{
      "Times plans of the demo's cell, and how soon they end when called off."};
  if (const auto code = app.parse(argc, argv)) return *code;
  const Cell cell = load_cell(CELLCAL_DEMO_CELL);
  measure(cell, 48, 8);
  measure(cell, 100, 30);
  measure(cell, 400, 30);
  return 0;
}
