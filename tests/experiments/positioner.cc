// An arm and a positioner that tilts and turns: its axes as identified and as drawn, and the arm's
// positions relative to the spheres on it.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "calib/estimate/external_axes.h"
#include "calib/files/files.h"
#include "calib/files/robot_file.h"
#include "calib/identify/identify.h"
#include "calib/identify/identify_once.h"
#include "calib/model/linear.h"
#include "calib/result/finding.h"
#include "tests/command_line/command_line.h"
#include "tests/experiments/trial.h"

namespace {

using namespace cellcal;
using Eigen::AngleAxisd;
using Eigen::Isometry3d;
using Eigen::Translation3d;
using Eigen::Vector3d;
using experiments::median;

/// A true positioner: rotations about lines in the base frame, by angles with their own zero, scale
/// and two waves, and compliance under the moments of its load.
class TruePositioner {
 public:
  TruePositioner(const calib::Robot& drawn, calib::Random& random) : drawn_(drawn) {
    constexpr double kPlaceM = 1.5e-3, kDirectionRad = 1.5e-3, kZeroRad = 1e-3, kScale = 1e-4;
    constexpr double kWaveRad = 5.0 / 3600.0 * std::numbers::pi / 180.0;
    const auto scattered = [&](double sigma) {
      return Vector3d(sigma * random.normal(), sigma * random.normal(), sigma * random.normal());
    };
    for (std::size_t j = 0; j < drawn.positioner.size(); ++j) {
      const Isometry3d place = calib::carried_at(drawn, std::vector<double>(j + 1, 0.0));
      axes_.push_back({place.translation() + scattered(kPlaceM),
                       (place.linear().col(2) + scattered(kDirectionRad)).normalized(),
                       drawn.positioner[j].sign * (1.0 + kScale * random.normal()),
                       kZeroRad * random.normal(),
                       {kWaveRad, kWaveRad / 2.0},
                       {random.uniform(0.0, 6.28), random.uniform(0.0, 6.28)},
                       place.linear(),
                       Vector3d::Zero()});
    }
    constexpr double kAcrossRadPerNm = 4e-7, kAboutRadPerNm = 1.5e-6;
    if (drawn.positioner.back().mass_kg > 0.0)
      for (Axis& axis : axes_)
        axis.give_rad_per_nm = {random.uniform(0.3, 2.0) * kAcrossRadPerNm,
                                random.uniform(0.3, 2.0) * kAcrossRadPerNm,
                                random.uniform(0.3, 2.0) * kAboutRadPerNm};
  }

  /// Motion of the table from its position at true zero.
  Isometry3d moved(std::span<const double> angles_rad) const {
    Isometry3d all = Isometry3d::Identity();
    const auto moment_nm = calib::carried_moment_nm(drawn_, angles_rad);
    for (std::size_t j = 0; j < angles_rad.size(); ++j) {
      const Axis& axis = axes_[j];
      const Vector3d give = axis.drawn * axis.give_rad_per_nm.cwiseProduct(moment_nm[j]);
      all = all * Translation3d(axis.point_m) * AngleAxisd(give.norm(), give.stableNormalized()) *
            AngleAxisd(axis.angle(angles_rad[j]), axis.direction) * Translation3d(-axis.point_m);
    }
    return all;
  }
  /// Point and direction with the controller's angles at 0, without a load.
  std::pair<Vector3d, Vector3d> line(std::size_t j) const {
    TruePositioner bare = *this;
    for (Axis& axis : bare.axes_) axis.give_rad_per_nm.setZero();
    const Isometry3d before = bare.moved(std::vector<double>(j, 0.0));
    return {before * axes_[j].point_m, before.linear() * axes_[j].direction};
  }

 private:
  struct Axis {
    Vector3d point_m, direction;
    double scale, zero_rad;
    double wave_rad[2], phase[2];
    Eigen::Matrix3d drawn;  ///< its frame with all axes at 0
    Vector3d give_rad_per_nm;
    double angle(double shown) const {
      double sum = zero_rad + scale * shown;
      for (int k = 0; k < 2; ++k) sum += wave_rad[k] * std::cos((k + 1) * shown + phase[k]);
      return sum;
    }
  };
  calib::Robot drawn_;
  std::vector<Axis> axes_;
};

struct Made {
  calib::Cell cell;
  experiments::World world;
  TruePositioner positioner;
  std::vector<calib::Touch> touches;
  std::size_t settings = 0;
};

/// Three spheres on the table and three on the floor; lengths only within each group.
calib::Cell drawn_cell(const calib::Robot& robot, const experiments::Stage& stage,
                       calib::Random& random) {
  constexpr double kPlaces[][3] = {{0.35, 0.0, 0.10},  {-0.17, 0.30, 0.20}, {-0.17, -0.30, 0.06},
                                   {0.75, -0.8, 0.35}, {0.75, 0.8, 0.65},   {0.3, -0.85, 0.9}};
  calib::Cell cell = experiments::make_cell(robot, stage, random);
  cell.lengths.clear();
  for (std::size_t i = 0; i < cell.targets.size(); ++i) {
    calib::Target& target = cell.targets[i];
    target.carried_by = i < 3 ? 2 : 0;
    target.diameter_m = 0.04;
    for (int k = 0; k < 3; ++k) target.centre_m[k] = kPlaces[i][k] + random.uniform(-0.02, 0.02);
  }
  for (std::size_t a = 0; a < cell.targets.size(); ++a)
    for (std::size_t b = a + 1; b < cell.targets.size(); ++b)
      if (cell.targets[a].carried_by == cell.targets[b].carried_by)
        cell.lengths.push_back({cell.targets[a].id, cell.targets[b].id,
                                (cell.targets[a].centre_m - cell.targets[b].centre_m).norm(),
                                5e-6});
  return cell;
}

std::optional<Made> made(const calib::Robot& robot, int fit, int check, std::uint64_t seed) {
  calib::Random random(seed);
  experiments::Stage stage;
  stage.spheres = 6;
  const calib::Cell cell = drawn_cell(robot, stage, random);
  calib::PlanOptions options;
  options.fit_touches = fit;
  options.check_touches = check;
  options.seed = static_cast<unsigned>(seed);
  calib::Plan plan;
  try {
    plan = calib::make_plan(cell, options);
  } catch (const calib::PlanError& error) {
    fmt::print(stderr, "seed {}: {}\n", seed, error.what());
    return std::nullopt;
  }
  experiments::World world(cell, stage, random);
  Made result{world.cell, std::move(world), TruePositioner(robot, random), {}, 1};
  const Isometry3d table = calib::carried_at(robot, std::vector<double>{0.0, 0.0});
  for (std::size_t t = 0; t < cell.targets.size(); ++t)
    if (cell.targets[t].carried_by > 0) result.world.centre_m[t] = table * result.world.centre_m[t];
  for (std::size_t i = 0; i < plan.touches.size(); ++i) {
    const calib::PlannedTouch& planned = plan.touches[i];
    result.settings += !planned.wait.empty();
    const std::size_t t = cell.target_index(planned.target);
    const Vector3d& at_zero = result.world.centre_m[t];
    const Vector3d moved = cell.targets[t].carried_by > 0
                               ? result.positioner.moved(planned.positioner_rad) * at_zero - at_zero
                               : Vector3d(Vector3d::Zero());
    auto touch = result.world.touch(planned, static_cast<double>(i) / plan.touches.size(),
                                    experiments::kBeyond, random, moved);
    if (!touch) continue;
    touch->positioner_rad = planned.positioner_rad;
    result.touches.push_back(std::move(*touch));
  }
  return result;
}

/// Motion from predicted to true tips: the base is a convention.
Isometry3d base_of(const Made& made, const calib::Calibration& c) {
  constexpr int kPostures = 1000;
  const calib::Predictor predictor(c);
  const auto postures =
      experiments::postures(calib::ArmModel(made.cell.robot, made.cell.tool), kPostures, 99);
  Eigen::Matrix3Xd predicted(3, kPostures), real(3, kPostures);
  for (int i = 0; i < kPostures; ++i) {
    predicted.col(i) = predictor.calibrated(postures[i]).tcp.translation();
    real.col(i) = made.world.arm.tip(postures[i]);
  }
  return calib::rigid_motion(predicted, real);
}

struct Column {
  struct OfAxis {
    std::vector<double> place_mm, direction_mrad, place_share, direction_share;
  };
  OfAxis axis[2];
  std::vector<double> covered, mean_mm, max_mm;
  int published = 0;
  std::string reasons;

  void add(const Made& made, const calib::Calibration& c, std::uint64_t seed) {
    const Isometry3d base = base_of(made, c);
    int inside = 0;
    for (std::size_t j = 0; j < 2; ++j) {
      const calib::PositionerLine& line = c.positioner[j];
      const auto [point, direction] = made.positioner.line(j);
      const double place_m = direction.cross(base * line.point_m - point).norm();
      const double angle_rad = (base.linear() * line.direction).cross(direction).norm();
      axis[j].place_mm.push_back(1e3 * place_m);
      axis[j].direction_mrad.push_back(1e3 * angle_rad);
      axis[j].place_share.push_back(line.place_u95_m / place_m);
      axis[j].direction_share.push_back(line.direction_u95_rad / angle_rad);
      inside += (place_m <= line.place_u95_m) + (angle_rad <= line.direction_u95_rad);
    }
    covered.push_back(100.0 * inside / 4.0);
    judge_table(made, c, base);
    published += c.verdict.publish();
    if (!c.verdict.publish())
      reasons +=
          fmt::format("    arm {} withheld: {}\n", seed, calib::words(c.verdict.findings)[0]);
  }

  /// Predicted places of spheres on the table, at settings over the whole range.
  void judge_table(const Made& made, const calib::Calibration& c, const Isometry3d& base) {
    constexpr int kSettings = 300;
    calib::Random random(7);
    double sum = 0.0, most = 0.0;
    int count = 0;
    for (int k = 0; k < kSettings; ++k) {
      std::vector<double> angles;
      for (const calib::PositionerAxis& drawn : made.cell.robot.positioner)
        angles.push_back(random.uniform(drawn.min_rad, drawn.max_rad));
      for (const calib::TargetResult& target : c.targets) {
        const std::size_t t = made.cell.target_index(target.id);
        if (made.cell.targets[t].carried_by == 0) continue;
        const Vector3d told = base * (calib::carried_as_found(c, angles) * target.centre_m);
        const double off = (told - made.positioner.moved(angles) * made.world.centre_m[t]).norm();
        sum += off;
        most = std::max(most, off);
        ++count;
      }
    }
    mean_mm.push_back(1e3 * sum / count);
    max_mm.push_back(1e3 * most);
  }

  void print(const char* name) const {
    const auto worst = [](const std::vector<double>& v) { return *std::ranges::max_element(v); };
    std::string axes;
    for (const OfAxis& one : axis)
      axes +=
          fmt::format(" {:.3f}, {:.3f} | {:.3f}, {:.3f} |", median(one.place_mm),
                      worst(one.place_mm), median(one.direction_mrad), worst(one.direction_mrad));
    double all = 0.0;
    for (const double one : covered) all += one / static_cast<double>(covered.size());
    fmt::print("| {} |{} {:.0f}, {:.1f} % | {:.3f}/{:.3f} | {:.3f}/{:.3f} | {} of {} |\n", name,
               axes, median(covered), all, median(mean_mm), median(max_mm), worst(mean_mm),
               worst(max_mm), published, covered.size());
  }
  void print_bounds() const {
    for (std::size_t j = 0; j < 2; ++j)
      fmt::print("E{}: u95 over error, median: place {:.2f}, direction {:.2f}\n", j + 1,
                 median(axis[j].place_share), median(axis[j].direction_share));
  }
};

/// A robot file without the load.
calib::Cell with_stiff_positioner(calib::Cell cell) {
  for (calib::PositionerAxis& axis : cell.robot.positioner) axis.mass_kg = 0.0;
  return cell;
}

/// A robot file that assumes the positioner to be exact.
calib::Cell with_exact_positioner(calib::Cell cell) {
  for (calib::PositionerAxis& axis : cell.robot.positioner)
    axis.place_sigma_m = axis.direction_sigma_rad = axis.scale_sigma = axis.mass_kg = 0.0;
  return cell;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    int robots = 20, fit = 130, check = 30;
    double load_kg = 0.0;
    std::uint64_t first = 1;
    cellcal::CommandLine app(
        "A KR 16 beside a positioner that tilts and turns: its axes [mm, mrad], and the spheres on "
        "it [mm].\nExample: positioner --robots 20");
    app.option("--robots", robots, "Random arms and positioners").between(1, 100);
    app.option("--number", fit, "Touches for the fit").between(10, 2000);
    app.option("--check", check, "Touches held out").between(0, 2000);
    app.option("--load", load_kg, "Mass on the table [kg], 0.12 m off its axis").between(0, 5000);
    app.option("--seed", first, "Of the first arm");
    if (const auto code = app.parse(argc, argv)) return *code;
    calib::Robot robot = calib::load_robot(CELLCAL_POSITIONER_ROBOT);
    robot.positioner.back().mass_kg = load_kg;
    robot.positioner.back().com_m = Vector3d(0.1, 0.07, 0.2);
    Column exact, stiff, found;
    std::vector<double> settings;
    for (std::uint64_t seed = first; static_cast<int>(found.covered.size()) < robots; ++seed) {
      if (seed > first + 200) throw std::runtime_error("no cell could be planned");
      const auto session = made(robot, fit, check, seed);
      if (!session) continue;
      settings.push_back(static_cast<double>(session->settings));
      found.add(*session,
                calib::identify(session->cell, session->touches,
                                {.region_poses = calib::kStatedPoses}, calib::shipped_robots),
                seed);
      exact.add(*session,
                calib::identify_single_pass(with_exact_positioner(session->cell), session->touches),
                seed);
      if (load_kg > 0.0)
        stiff.add(*session,
                  calib::identify(with_stiff_positioner(session->cell), session->touches,
                                  {.region_poses = calib::kStatedPoses}, calib::shipped_robots),
                  seed);
      fmt::print(stderr, "\r{} of {}", found.covered.size(), robots);
    }
    fmt::print(stderr, "\r");
    fmt::print("{} touches and {} held out at {:.0f} settings\n\n", fit, check, median(settings));
    fmt::print(
        "| positioner | E1 place: median, worst | direction | E2 place | direction | inside u95: "
        "median, all | on the table: median | worst | published |\n|---|---|---|---|---|---|---|---|---|\n");
    exact.print("as drawn");
    if (load_kg > 0.0) stiff.print("identified without its load");
    found.print("identified");
    found.print_bounds();
    fmt::print("{}", found.reasons);
    return 0;
  } catch (const std::exception& e) {
    std::fprintf(stderr, "positioner: %s\n", e.what());
    return 1;
  }
}
