// Benefit of a corrected KRL program: 200 taught points, calibrations of level L1, L2 and L3 of the emulated cell's
// hidden arm, and the tip of the hidden arm when a nominal controller runs the original and the corrected program.
//
// The controller reads the .dat as text and uses the nominal arm and KUKA's S and T only
// (tests/daemon/krl/emulated_controller); the hidden arm is that of sim/demo.
//
// At run time: the motions rewritten for CELLCAL_FIX, executed by an interpreter with 32-bit REAL, which also executes
// the original program.
//
// With --folder it counts instead the results for programs of other controllers: each folder below is a backup.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "calib/estimate/predict.h"
#include "calib/files/robot_file.h"
#include "calib/identify/identify.h"
#include "calib/model/linear.h"
#include "calib/model/units.h"
#include "calib/plan/plan.h"
#include "daemon/krl/correct_program.h"
#include "daemon/krl/fix_module.h"
#include "daemon/krl/run_time_program.h"
#include "tests/calib/simulate.h"
#include "tests/command_line/command_line.h"
#include "tests/daemon/krl/emulated_controller.h"
#include "tests/daemon/krl/krl_controller.h"
#include "tests/experiments/program_reasons.h"
#include "tests/experiments/trial.h"

namespace {

using namespace cellcal;  // NOLINT: an experiment's own file
using calib::JointVector;
using experiments::median;

struct Level {
  const char* name;
  bool one_sphere;
  int touches;
};
constexpr Level kLevels[] = {{"L1", true, 50}, {"L2", false, 100}, {"L3", false, 400}};

struct Distances {
  double mean_mm = 0.0, max_mm = 0.0;
};

/// `align`: after alignment of the base, as by measuring it with the arm.
Distances distances(const Eigen::Matrix3Xd& is, const Eigen::Matrix3Xd& wanted, bool align) {
  Eigen::Matrix4d motion = Eigen::Matrix4d::Identity();
  if (align) motion = calib::rigid_motion(is, wanted).matrix();
  const Eigen::VectorXd off =
      ((motion.topLeftCorner<3, 3>() * is).colwise() + motion.topRightCorner<3, 1>() - wanted)
          .colwise()
          .norm()
          .transpose() *
      calib::kMmPerM;
  return {off.mean(), off.maxCoeff()};
}

Eigen::Matrix3Xd tips(const sim::Truth& truth, const std::vector<JointVector>& joints) {
  Eigen::Matrix3Xd all(3, static_cast<Eigen::Index>(joints.size()));
  for (std::size_t i = 0; i < joints.size(); ++i)
    all.col(static_cast<Eigen::Index>(i)) =
        truth.arm.position(truth.arm.prepare(joints[i]), truth.errors.data());
  return all;
}

/// In front of the arm, away from singularities of the wrist and the elbow.
std::vector<JointVector> points(const calib::Cell& cell, int count) {
  constexpr double kLeastDeterminant = 5e-3, kLeastWristDeg = 10.0;
  const calib::ArmModel arm(cell);
  std::vector<JointVector> all;
  for (const JointVector& q : experiments::postures(arm, 20 * count, 7)) {
    const auto j = arm.nominal_jacobian(q);
    const bool regular = std::abs((j * j.transpose()).determinant()) > kLeastDeterminant &&
                         std::abs(q[4]) > kLeastWristDeg * calib::kRadPerDeg;
    if (regular && static_cast<int>(all.size()) < count) all.push_back(q);
  }
  return all;
}

struct Outcome {
  Distances before, after, before_aligned, after_aligned;
  Distances running, running_aligned;                                    ///< corrected at run time
  double statements = 0.0, operations = 0.0, frames = 0.0, calls = 0.0;  ///< per point
  double u95_mm = 0.0, shift_mm = 0.0;
  bool published = false;
};

using Files = std::map<std::string, std::string>;

/// Joint angles at the taught points as commanded by an interpreter, starting at the home position.
std::vector<JointVector> executed(const calib::Robot& robot, const daemon::testing::Frames& frames,
                                  const Files& files, std::size_t count,
                                  sim::krl::Interpreter::Executed* counts = nullptr) {
  daemon::testing::KrlController controller(robot, files);
  controller.put_data("TOOL_DATA", 1, frames.tool);
  controller.put_data("BASE_DATA", 3, frames.base);
  controller.run("WELD");
  if (controller.reached.size() != count + 1)
    throw std::runtime_error("the program stopped: " + controller.message() + " " +
                             (controller.messages.empty() ? "" : controller.messages.back()));
  if (counts != nullptr) *counts = controller.executed();
  return {controller.reached.begin() + 1, controller.reached.end()};
}

/// The program with rewritten motions, and CELLCAL_FIX.
Files for_run_time(const calib::Calibration& calibration,
                   const daemon::testing::KrlProgram& program) {
  constexpr int kSerial = 4711;  // of the emulated controller
  daemon::krl::BackupFiles files;
  files.modules.push_back(
      {{"weld.src", program.src}, daemon::krl::KrlFile{"weld.dat", program.dat}, {}, {}});
  files.controller = {{"$config.dat", program.config}};
  const auto rewritten = rewrite_motions(files, {});
  daemon::krl::Data data;
  read_data(files.controller[0], data);
  const auto fix = fix_module(calibration, data, {kSerial, "0"});
  return {{"weld.src", rewritten.files.at(0).text},
          {"weld.dat", program.dat},
          {fix.src.name, fix.src.text},
          {fix.dat.name, fix.dat.text}};
}

Outcome run(const Level& level, const calib::Plan* plan, std::uint64_t seed, int count) {
  const calib::Cell& cell =
      level.one_sphere ? calib::testing::one_sphere_cell() : calib::testing::demo_cell();
  sim::TruthOptions options;  // as in sim/demo
  options.seed = seed;
  options.deflection = 0.002;
  options.gear_arcsec = 7.0;
  options.compliance_rad_per_nm = 5e-6;
  options.play_arcsec = 10.0;
  options.tip_offset_m = 0.5e-3;
  const sim::Truth truth = sim::draw_truth(cell, options);
  calib::testing::Making making;
  making.fit = level.touches;
  making.check = 20;
  making.outlier_share = 0.02;
  making.seed = static_cast<unsigned>(seed);
  const auto made = plan == nullptr ? calib::testing::make_touches(cell, truth, making)
                                    : calib::testing::make_touches(cell, truth, *plan, making);
  const calib::Calibration calibration =
      calib::identify(cell, made.touches, {}, calib::shipped_robots);

  daemon::testing::Frames frames;
  frames.tool = cell.tool.tcp;
  frames.base = calib::to_isometry({{700.0, -250.0, 300.0}, {30.0, 2.0, -1.0}});
  const auto taught = points(cell, count);
  const auto program = daemon::testing::taught(cell.robot, frames, taught);
  daemon::krl::CorrectionOptions correction;
  correction.anywhere = true;  // one sphere claims nothing beyond its surroundings
  const auto corrected = correct_program(calibration,
                                         {{"weld.src", program.src},
                                          daemon::krl::KrlFile{"weld.dat", program.dat},
                                          {{"$config.dat", program.config}}},
                                         correction);
  if (corrected.files.size() != 2)
    throw std::runtime_error("refused: " + words(corrected.refusals.at(0), cell.robot));

  const calib::ArmModel nominal(cell);
  Eigen::Matrix3Xd wanted(3, static_cast<Eigen::Index>(taught.size()));
  for (std::size_t i = 0; i < taught.size(); ++i)
    wanted.col(static_cast<Eigen::Index>(i)) = nominal.nominal_tip_m(taught[i]);
  const auto before =
      tips(truth, executed(cell.robot, frames,
                           {{"weld.src", program.src}, {"weld.dat", program.dat}}, taught.size()));
  const auto after = tips(truth, daemon::testing::run(cell.robot, frames, corrected.files[1].text));
  Outcome o;
  o.before = distances(before, wanted, false);
  o.after = distances(after, wanted, false);
  o.before_aligned = distances(before, wanted, true);
  o.after_aligned = distances(after, wanted, true);
  sim::krl::Interpreter::Executed counts;
  const auto running = tips(truth, executed(cell.robot, frames, for_run_time(calibration, program),
                                            taught.size(), &counts));
  o.running = distances(running, wanted, false);
  o.running_aligned = distances(running, wanted, true);
  const auto points = static_cast<double>(taught.size());
  o.statements = static_cast<double>(counts.statements) / points;
  o.operations = static_cast<double>(counts.operations) / points;
  o.frames = static_cast<double>(counts.frames) / points;
  o.calls = static_cast<double>(counts.calls) / points;
  o.shift_mm = corrected.largest()->shift_mm.norm();
  o.published = calibration.verdict.publish();
  for (const auto& point : corrected.points)
    o.u95_mm += point.u95_mm / static_cast<double>(corrected.points.size());
  return o;
}

calib::Plan plan_of(const Level& level) {
  calib::PlanOptions options;
  options.fit_touches = level.touches;
  options.check_touches = 20;
  return calib::make_plan(
      level.one_sphere ? calib::testing::one_sphere_cell() : calib::testing::demo_cell(), options);
}

double median_of(const std::vector<Outcome>& all, double (*value)(const Outcome&)) {
  std::vector<double> values;
  for (const Outcome& one : all) values.push_back(value(one));
  return median(values);
}

void print(const Level& level, const std::vector<Outcome>& all) {
  int published = 0;
  double worst = 0.0;
  for (const Outcome& one : all) {
    published += one.published ? 1 : 0;
    worst = std::max(worst, one.after_aligned.max_mm);
  }
  fmt::print(
      "{}  {:>3} touches  {:>2} of {} let through   as it was {:.3f}/{:.3f} mm   corrected "
      "{:.3f}/{:.3f} mm   base measured: {:.3f}/{:.3f} -> {:.3f}/{:.3f} mm, worst {:.3f}   u95 "
      "{:.3f}   largest shift {:.2f}\n",
      level.name, level.touches, published, all.size(),
      median_of(all, [](const Outcome& o) { return o.before.mean_mm; }),
      median_of(all, [](const Outcome& o) { return o.before.max_mm; }),
      median_of(all, [](const Outcome& o) { return o.after.mean_mm; }),
      median_of(all, [](const Outcome& o) { return o.after.max_mm; }),
      median_of(all, [](const Outcome& o) { return o.before_aligned.mean_mm; }),
      median_of(all, [](const Outcome& o) { return o.before_aligned.max_mm; }),
      median_of(all, [](const Outcome& o) { return o.after_aligned.mean_mm; }),
      median_of(all, [](const Outcome& o) { return o.after_aligned.max_mm; }), worst,
      median_of(all, [](const Outcome& o) { return o.u95_mm; }),
      median_of(all, [](const Outcome& o) { return o.shift_mm; }));
  const double offline = median_of(all, [](const Outcome& o) { return o.after_aligned.mean_mm; });
  const double running = median_of(all, [](const Outcome& o) { return o.running_aligned.mean_mm; });
  fmt::print(
      "    at run time {:.3f}/{:.3f} mm   base measured: {:.3f}/{:.3f} mm, {:.3f} times offline   a "
      "point: {:.0f} statements, {:.0f} operations, {:.0f} frames, {:.0f} functions\n",
      median_of(all, [](const Outcome& o) { return o.running.mean_mm; }),
      median_of(all, [](const Outcome& o) { return o.running.max_mm; }), running,
      median_of(all, [](const Outcome& o) { return o.running_aligned.max_mm; }), running / offline,
      median_of(all, [](const Outcome& o) { return o.statements; }),
      median_of(all, [](const Outcome& o) { return o.operations; }),
      median_of(all, [](const Outcome& o) { return o.frames; }),
      median_of(all, [](const Outcome& o) { return o.calls; }));
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
  try {
    int arms = 10, count = 200;
    std::uint64_t seed = 1;
    bool verbose = false, planned = false;
    std::string only, folder;
    CommandLine app(
        "TCP error at the taught points of a KRL program before and after its correction.\n"
        "Example: programs --arms 20 --level L2\n"
        "         programs --folder backups");
    app.option("--folder", folder, "Count what becomes of the programs below it, by reason");
    app.option("--verbose", verbose, "With --folder: the first refusal of each module");
    app.option("--arms", arms, "Hidden arms per level").between(1, 1000);
    app.option("--points", count, "Taught points").between(3, 1000);
    app.option("--level", only, "Only this one").one_of({"L1", "L2", "L3"});
    app.option("--planned", planned, "Touches of a plan, as a session makes them, not random ones");
    app.option("--seed", seed, "");
    if (const auto code = app.parse(argc, argv)) return *code;
    if (!folder.empty()) return experiments::print_reasons(folder, verbose);
    fmt::print("TCP error at {} taught points, mean/max in mm, median over {} arms\n", count, arms);
    for (const Level& level : kLevels) {
      if (!only.empty() && only != level.name) continue;
      std::optional<calib::Plan> plan;
      if (planned) plan = plan_of(level);
      std::vector<Outcome> all;
      for (int k = 0; k < arms; ++k)
        all.push_back(
            run(level, plan ? &*plan : nullptr, seed + static_cast<std::uint64_t>(k), count));
      print(level, all);
    }
    return 0;
  } catch (const std::exception& e) {
    std::fprintf(stderr, "programs: %s\n", e.what());
    return 1;
  }
}
