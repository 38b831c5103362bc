// The check of a calibration by a few touches: detection rates, false alarms, accuracy of the measured tool
// shift, and confusion of causes.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <optional>

#include "calib/check/tcp_check.h"
#include "calib/files/files.h"
#include "calib/files/robot_file.h"
#include "calib/identify/identify.h"
#include "calib/model/linear.h"
#include "calib/plan/check_plan.h"
#include "calib/plan/duration.h"
#include "tests/command_line/command_line.h"
#include "tests/experiments/happening.h"
#include "tests/experiments/trial.h"

namespace {

using namespace cellcal;
using calib::ChangeKind;
using experiments::Gears;

using Fault = experiments::Happening;

/// One arm with its calibration and its planned check.
struct Calibrated {
  experiments::World world;
  calib::Calibration calibration;
  calib::Plan plan;
  std::optional<calib::TcpChecker> checker;
  double seconds = 0.0;
};

std::vector<calib::Touch> expected(const calib::Plan& plan) {
  std::vector<calib::Touch> touches;
  for (const calib::PlannedTouch& planned : plan.touches) {
    calib::Touch touch;
    touch.target = planned.target;
    const double share = planned.expected_m / planned.search_m;
    for (std::size_t i = 0; i < planned.standoff.size(); ++i)
      touch.joint_rad.push_back(planned.standoff[i] +
                                share * (planned.end[i] - planned.standoff[i]));
    touches.push_back(std::move(touch));
  }
  return touches;
}

std::optional<Calibrated> calibrated(const calib::Robot& robot, const experiments::Trial& trial,
                                     const calib::CheckPlanOptions& how, std::uint64_t seed,
                                     bool& withheld) {
  auto session = experiments::measured(robot, trial, seed);
  if (!session) return std::nullopt;
  calib::Calibration c =
      calib::identify(session->world.cell, session->touches, {}, calib::shipped_robots);
  withheld = !c.verdict.publish();
  if (withheld) return std::nullopt;
  calib::Plan plan = calib::make_check_plan(c, {}, how);
  calib::Pace pace;
  pace.predicted_m = how.before_m;
  const double seconds = calib::duration_s(plan, robot, pace);
  return Calibrated{std::move(session->world), std::move(c), std::move(plan), {}, seconds};
}

struct Made {
  std::vector<calib::Touch> touches;
  experiments::Happened happened;
};

/// Touches of the check by the arm after the fault.
std::optional<Made> made(const Calibrated& on, const Fault& fault, calib::Random& random) {
  experiments::World world = on.world;
  Made result{{}, experiments::happen(fault, world, random)};
  // As warm as at some time of the calibration.
  const double warm = random.uniform();
  for (const calib::PlannedTouch& planned : on.plan.touches) {
    auto touch = world.touch(planned, warm, experiments::kBeyond, random);
    if (!touch) return std::nullopt;
    result.touches.push_back(std::move(*touch));
  }
  return result;
}

/// Rare events require many checks; the others a share of them.
int checks_of(const Fault& fault, int checks) {
  return fault.kind == ChangeKind::kNothing ? checks : checks / 12;
}

struct Row {
  Fault fault;
  int made = 0, alarms = 0, right = 0;
  std::map<std::string, int> named;
  double squares = 0.0, worst = 0.0, foreseen = 0.0;
};

void add(Row& row, const Calibrated& on, calib::Random& random) {
  const auto touches = made(on, row.fault, random);
  if (!touches) return;
  const calib::TcpCheck check = on.checker->judge(touches->touches);
  ++row.made;
  const calib::Explanation& change = *check.change();
  row.alarms += !check.holds;
  std::string named = check.holds ? "nothing" : to_string(change.kind);
  if (!check.holds && change.kind == row.fault.kind &&
      (touches->happened.which.empty() || touches->happened.which == change.name))
    ++row.right;
  else if (!check.holds && change.kind == row.fault.kind)
    named = std::string("other ") + to_string(change.kind);
  ++row.named[named];
  const bool of_tool =
      row.fault.kind == ChangeKind::kNothing || row.fault.kind == ChangeKind::kTool;
  if (!of_tool) return;
  const double off = (check.shift_m - touches->happened.tool_shift_m).norm();
  row.squares += off * off;
  row.worst = std::max(row.worst, off);
  row.foreseen += check.covariance_m2.trace();
}

void print(const std::vector<Row>& rows) {
  const std::vector<std::string> named{"nothing", "tool",        "sphere", "other sphere",
                                       "joint",   "other joint", "growth", "touch"};
  fmt::print("{:<18} {:>7} {:>9} {:>8}", "what was done", "checks", "alarms %", "right %");
  for (const std::string& one : named) fmt::print(" {:>12}", one);
  fmt::print("   TCP rms, max, foreseen mm\n");
  for (const Row& row : rows) {
    const double n = std::max(1, row.made);
    fmt::print(
        "{:<18} {:>7} {:>9.2f} {:>8.1f}", name_of(row.fault), row.made, 100.0 * row.alarms / n,
        100.0 * (row.fault.kind == ChangeKind::kNothing ? row.made - row.alarms : row.right) / n);
    for (const std::string& one : named) {
      const auto found = row.named.find(one);
      fmt::print(" {:>12.1f}", found == row.named.end() ? 0.0 : 100.0 * found->second / n);
    }
    if (row.squares > 0.0)
      fmt::print("   {:.3f} {:.3f} {:.3f}", 1e3 * std::sqrt(row.squares / n), 1e3 * row.worst,
                 1e3 * std::sqrt(row.foreseen / n));
    fmt::print("\n");
  }
}

/// All checks after this many that held, over all arms.
struct Table {
  int references = 0;
  std::vector<Row> rows;
  std::vector<double> found, sigma;  ///< predicted: %, mm
};

Table table_of(int references) {
  Table table{references, {}, {}, {}};
  for (const Fault& fault : {Fault{ChangeKind::kNothing, 0.0}, Fault{ChangeKind::kTool, 0.10e-3},
                             Fault{ChangeKind::kTool, 0.15e-3}, Fault{ChangeKind::kTool, 0.3e-3},
                             Fault{ChangeKind::kTool, 1e-3}, Fault{ChangeKind::kSphere, 0.3e-3},
                             Fault{ChangeKind::kSphere, 1e-3}, Fault{ChangeKind::kJoint, 0.3e-3},
                             Fault{ChangeKind::kJoint, 1e-3}, Fault{ChangeKind::kGrowth, 100e-6},
                             Fault{ChangeKind::kGrowth, 300e-6}})
    table.rows.emplace_back().fault = fault;
  return table;
}

void add(Table& table, Calibrated& on, int checks, std::uint64_t seed, bool detail) {
  calib::Random random(seed + 11);
  std::vector<std::vector<calib::Touch>> before;
  for (int i = 0; i < table.references; ++i)
    if (const auto one = made(on, {}, random)) before.push_back(one->touches);
  on.checker.emplace(on.calibration, expected(on.plan), before);
  constexpr double kShiftM = 0.15e-3;
  table.found.push_back(100.0 * on.checker->alarm().found(kShiftM));
  table.sigma.push_back(1e3 * std::sqrt(on.checker->shift_covariance_m2().trace()));
  int made_before = table.rows.front().alarms;
  for (Row& row : table.rows)
    for (int i = 0; i < checks_of(row.fault, checks); ++i) add(row, on, random);
  if (!detail) return;
  fmt::print(
      "  {}: {} before; {} touches, {:.1f} s, finds 0.15 mm {:.1f} %, TCP {:.3f} mm, {} false alarms\n",
      seed, table.references, on.plan.touches.size(), on.seconds, table.found.back(),
      table.sigma.back(), table.rows.front().alarms - made_before);
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
  try {
    experiments::Trial trial;
    calib::CheckPlanOptions how;
    int arms = 24, checks = 12000;
    std::vector<int> references{0, 3};
    std::uint64_t seed_from = 1;
    std::string gears = "spectrum", level = "L2";
    bool detail = false;
    cellcal::CommandLine app(
        "The check by six to eight touches: power, false alarms, accuracy, causes.\n"
        "Example: checks --arms 10 --checks 1000 --gears harmonics");
    app.option("--arms", arms, "Random arms, each calibrated once");
    app.option("--checks", checks,
               "Of all arms with nothing changed; a twelfth of them of each change");
    app.option("--level", level, "Touches of the calibration: L2 100, L3 400").one_of({"L2", "L3"});
    app.option("--gears", gears, "Truth's form").one_of({"none", "harmonics", "spectrum"});
    app.option("--gear-arcsec", trial.gear_arcsec, "rms per joint");
    app.option("--touches", how.most_touches, "Of a check, at most");
    app.option("--references", references, "Checks before, behind the calibration, which held");
    app.option("--seconds", how.most_s, "Of robot time, at most");
    app.option("--seed", seed_from, "");
    app.option("--detail", detail, "Each arm");
    if (const auto code = app.parse(argc, argv)) return *code;
    trial.gears = gears == "none"       ? Gears::kNone
                  : gears == "spectrum" ? Gears::kSpectrum
                                        : Gears::kHarmonics;
    trial.check = 10;
    if (level == "L3") {
      trial.spheres = 6;
      trial.fit = 400;
    }
    const calib::Robot robot = calib::load_robot(CELLCAL_EXPERIMENT_ROBOT);
    std::vector<Table> tables;
    for (const int count : references) tables.push_back(table_of(count));
    int done = 0, withheld = 0;
    std::vector<double> seconds, touches;
    constexpr std::uint64_t kMostSeeds = 100000;
    for (std::uint64_t k = 0; done < arms && k < kMostSeeds; ++k) {
      const std::uint64_t seed = seed_from * kMostSeeds + k;
      bool is_withheld = false;
      auto on = calibrated(robot, trial, how, seed, is_withheld);
      withheld += is_withheld;
      if (!on) continue;
      ++done;
      seconds.push_back(on->seconds);
      touches.push_back(static_cast<double>(on->plan.touches.size()));
      for (Table& table : tables) add(table, *on, checks / arms, seed, detail);
    }
    fmt::print(
        "{} arms ({} withheld and drawn again), gears {} {:.0f}\", calibrated by {} touches of {} spheres\n"
        "a check: {} touches, {:.1f} s of robot time from rest and back, medians; at most {:.1f} s\n",
        done, withheld, gears, trial.gear_arcsec, trial.fit, trial.spheres,
        experiments::median(touches), experiments::median(seconds),
        *std::max_element(seconds.begin(), seconds.end()));
    for (Table& table : tables) {
      fmt::print(
          "\nbehind the calibration and {} checks that held; foreseen: 0.15 mm of the tool found in {:.1f} % "
          "(median arm), {:.1f} % (worst); TCP {:.3f} mm rms\n",
          table.references, experiments::median(table.found),
          *std::min_element(table.found.begin(), table.found.end()),
          experiments::median(table.sigma));
      print(table.rows);
    }
    return 0;
  } catch (const std::exception& e) {
    std::fprintf(stderr, "checks: %s\n", e.what());
    return 1;
  }
}
