// Moves through way-points over many random paths: peaks of the moves and their brakes relative to
// the axis limits, durations relative to stopping at each way-point, and the time of planning one.

#include <fmt/format.h>

#include <ctime>

#include "tests/bench/times.h"
#include "tests/command_line/command_line.h"
#include "tests/drivers/kuka/rsi/path_cases.h"

namespace {

using namespace cellcal::drivers;  // NOLINT: a benchmark's own file
using cellcal::bench::Times;

/// CPU time of the thread, so that other load on the machine does not count.
double cpu_us() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return 1e6 * static_cast<double>(now.tv_sec) + 1e-3 * static_cast<double>(now.tv_nsec);
}

/// Paths of any form, including degenerate ones: shares of the limits, analytic and by differences.
void odd_paths(long count, std::uint64_t seed) {
  PathCases cases(seed);
  Peaks moves, brakes, seen;
  double astray = 0.0, slowest = 0.0;
  for (long c = 0; c < count; ++c) {
    const PathCase one = cases.odd();
    const PathMove move = one.move();
    moves.take(peaks(move, one.limits, 48));
    slowest = std::max(slowest, move.duration_s() / one.with_stops().duration_s());
    PathMove braked = move;
    braked.brake_at(cases.uniform(0.0, move.duration_s()));
    brakes.take(peaks(braked, one.limits, 24));
    astray = std::max(astray, astray_rad(one, braked.at(braked.duration_s())));
    astray = std::max(astray, astray_rad(one, move.at(cases.uniform(0.0, move.duration_s()))));
    if (c % 20 == 0) seen.take(differences(one, 200));
  }
  const auto row = [](const char* what, const Peaks& most) {
    fmt::print("{:42} speed {:.9f}  acceleration {:.9f}  jerk {:.9f}\n", what, most.speed,
               most.acceleration, most.jerk);
  };
  fmt::print("{} paths of any form, largest share of an axis limit\n", count);
  row("  on the path, analytic", moves);
  row("  in a brake from any instant, analytic", brakes);
  row("  by differences of positions (one in 20)", seen);
  fmt::print("  farthest from legs and triangles: {:.1e} rad\n", astray);
  fmt::print("  longest beside stopping at each way-point: {:.9f}\n", slowest);
}

/// Paths of a six-axis arm.
void usual_paths(int count, int points, std::uint64_t seed) {
  PathCases cases(seed);
  Times plan, brake_plan;
  double passed_s = 0.0, stopped_s = 0.0, brake_s = 0.0, longest_s = 0.0;
  for (int c = 0; c < count; ++c) {
    const PathCase one = cases.usual(points);
    double begun = cpu_us();
    PathMove move = one.move();
    plan.add(cpu_us() - begun);
    passed_s += move.duration_s();
    stopped_s += one.with_stops().duration_s();
    const double at_s = cases.uniform(0.0, move.duration_s());
    begun = cpu_us();
    move.brake_at(at_s);
    brake_plan.add(cpu_us() - begun);
    brake_s += move.duration_s();
    longest_s = std::max(longest_s, move.duration_s());
  }
  fmt::print(
      "{:3} way-points: {:6.3f} s, stopping {:6.3f} s, ratio {:.3f}; brake {:.3f} s, longest {:.3f};"
      " planned in {:5.1f} us, p99 {:5.1f}, worst {:6.1f}; brake in {:5.1f}, worst {:6.1f}\n",
      points, passed_s / count, stopped_s / count, passed_s / stopped_s, brake_s / count, longest_s,
      plan.quantile(0.5), plan.quantile(0.99), plan.worst(), brake_plan.quantile(0.5),
      brake_plan.worst());
}

}  // namespace

int main(int argc, char** argv) {
  long odd = 1'000'000;
  int usual = 2000;
  std::uint64_t seed = 20261122;
  cellcal::CommandLine app("Moves through way-points");
  app.option("--odd", odd, "random paths of any form, for the limits");
  app.option("--usual", usual, "paths of an arm for each number of way-points, for the times");
  app.option("--seed", seed, "of the paths");
  if (const auto code = app.parse(argc, argv)) return *code;
  for (const int points : {0, 1, 2, 4, 8, 12}) usual_paths(usual, points, seed);
  odd_paths(odd, seed);
  return 0;
}
