#include "tests/experiments/trial.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <ranges>

#include "calib/estimate/predict.h"
#include "calib/estimate/region.h"
#include "calib/export/corrector.h"
#include "calib/files/robot_file.h"
#include "calib/identify/identify.h"
#include "calib/model/linear.h"
#include "calib/model/units.h"
#include "calib/plan/duration.h"
#include "calib/result/finding.h"

namespace cellcal::experiments {

namespace {

/// Residuals after the best rigid motion of `points` onto `real`.
Eigen::VectorXd aligned_errors(const Eigen::Matrix3Xd& points, const Eigen::Matrix3Xd& real) {
  const Eigen::Matrix4d motion = calib::rigid_motion(points, real).matrix();
  return ((motion.topLeftCorner<3, 3>() * points).colwise() + motion.topRightCorner<3, 1>() - real)
      .colwise()
      .norm()
      .transpose();
}

/// Mean error of the nominal model over the poses.
double nominal_mean_m(const TrueArm& arm, const calib::Predictor& predictor,
                      const std::vector<calib::JointVector>& poses) {
  const auto n = static_cast<Eigen::Index>(poses.size());
  Eigen::Matrix3Xd real(3, n), nominal(3, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const auto& q = poses[static_cast<std::size_t>(i)];
    real.col(i) = arm.tip(q);
    nominal.col(i) = predictor.nominal(q).translation();
  }
  return aligned_errors(nominal, real).mean();
}

}  // namespace

OverPostures judge(const TrueArm& arm, const calib::Predictor& predictor,
                   const std::vector<calib::JointVector>& poses) {
  const auto n = static_cast<Eigen::Index>(poses.size());
  Eigen::Matrix3Xd real(3, n), predicted(3, n);
  Eigen::VectorXd u95(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const auto& q = poses[static_cast<std::size_t>(i)];
    const calib::Prediction p = predictor.calibrated(q);
    real.col(i) = arm.tip(q);
    predicted.col(i) = p.tcp.translation();
    u95[i] = p.u95_m;
  }
  const Eigen::VectorXd e = aligned_errors(predicted, real);
  const auto count = static_cast<double>(n);
  return {e.mean(), e.maxCoeff(), std::sqrt(e.squaredNorm() / count),
          static_cast<double>((e.array() <= u95.array()).count()) / count, u95.mean()};
}

std::vector<calib::JointVector> postures(const calib::ArmModel& arm, int count, unsigned seed) {
  constexpr double kLowDeg[] = {-60.0, -120.0, 20.0, -170.0, -110.0, -170.0};
  constexpr double kHighDeg[] = {60.0, -10.0, 145.0, 170.0, 110.0, 170.0};
  constexpr double kFloorM = 0.05;
  const std::size_t first = arm.robot().first_turning();
  if (arm.joint_count() != static_cast<int>(first) + 6)
    return calib::workspace_poses(arm, count, seed);
  const Eigen::Isometry3d to_foot = arm.robot().base_fixed.inverse();
  calib::Random random(seed);
  std::vector<calib::JointVector> poses;
  while (static_cast<int>(poses.size()) < count) {
    calib::JointVector q;
    for (const calib::Joint& joint : arm.robot().joints | std::views::take(first))
      q.push_back(random.uniform(joint.min_rad, joint.max_rad));
    for (std::size_t i = 0; i < 6; ++i)
      q.push_back(random.uniform(kLowDeg[i], kHighDeg[i]) * std::numbers::pi / 180.0);
    if ((to_foot * arm.nominal_tip_m(q)).z() > kFloorM) poses.push_back(std::move(q));
  }
  return poses;
}

namespace {

/// Centre of mass of everything on the flange with a load.
const Eigen::Vector3d kLoadedComM(0.0, 0.0, 0.15);

/// The load as stated in the cell file: in addition to the tool.
calib::Load beside(const calib::Tool& tool, double all_kg) {
  const double mass_kg = all_kg - tool.mass_kg;
  return {"full", mass_kg, (all_kg * kLoadedComM - tool.mass_kg * tool.com_m) / mass_kg};
}

/// Waves found in the joints, and those of them that match no wave of the true gear.
void count_waves(const TrueArm& arm, const calib::Robot& robot, Outcome& o) {
  const std::size_t first = robot.first_turning();
  constexpr double kSame = 2.0;  // orders that are indistinguishable over some 180 degrees
  for (std::size_t i = first; i < robot.joints.size(); ++i)
    for (const calib::JointWave& found : robot.joints[i].waves) {
      ++o.waves;
      const auto same = [&](const GearWave& wave) {
        return std::abs(wave.order - found.order) < kSame;
      };
      if (std::ranges::none_of(arm.waves(i - first), same)) ++o.false_waves;
    }
}

/// Two integer orders for each of the gears' waves, which have arbitrary orders.
void state_waves(const TrueArm& arm, calib::Robot& robot) {
  const std::size_t first = robot.first_turning();
  for (std::size_t i = first; i < robot.joints.size(); ++i)
    for (const GearWave& wave : arm.waves(i - first)) {
      const auto order = static_cast<int>(wave.order);
      const double sigma_rad = wave.amplitude / std::numbers::sqrt2;
      if (order >= calib::kLowestOrder)
        for (const int near : {order, order + 1})
          robot.joints[i].waves.push_back({near, sigma_rad});
    }
}

}  // namespace

Outcome judged(World world, const std::vector<calib::Touch>& touches, double load_kg,
               bool functions) {
  calib::Calibration c = calib::identify(
      world.cell, touches, {.region_poses = calib::kStatedPoses, .functions = functions},
      calib::shipped_robots);
  if (load_kg > 0.0) {
    world.arm.carry(load_kg, kLoadedComM);
    c = calib::with_load(std::move(c), {load_kg, kLoadedComM});
  }
  const calib::Predictor predictor(c);
  Outcome o;
  count_waves(world.arm, c.cell.robot, o);
  o.m1 = c.check.mean_m;
  o.m1_max = c.check.max_m;
  o.published = c.verdict.publish();
  o.unchecked = calib::has(c.verdict.findings, calib::FindingKind::kUncheckedTouch);
  const std::vector<std::string> reasons = calib::words(c.verdict.findings);
  if (!o.published && !reasons.empty()) o.why_not = reasons.front();
  for (const auto& t : c.targets)
    o.rho_error = std::max(o.rho_error, std::abs(t.effective_radius_m - 0.0307 - world.rho_m));
  const calib::ArmModel model(world.cell.robot, world.cell.tool);
  const OverPostures all = judge(world.arm, predictor, postures(model, 1000, 99));
  o.m3 = all.mean;
  o.m3_max = all.max;
  o.rms = all.rms;
  o.m4 = all.covered;
  o.u95 = all.u95;
  o.predicted_m3 = c.predicted_workspace_m;
  o.nominal_m3 = c.nominal_workspace_m;
  o.field = c.discrepancy.sigma_m;
  o.estimated = c.discrepancy.estimated;
  o.alike = c.discrepancy.alike;
  if (!o.published)
    for (const auto& r : reasons) o.why_not += " | " + r.substr(0, 160);
  std::vector<calib::JointVector> around;
  for (const auto& t : touches) around.push_back(t.joint_rad);
  const OverPostures local =
      judge(world.arm, predictor, calib::local_poses(model, around, world.centre_m, 300, 98));
  o.m2 = local.mean;
  o.m2_max = local.max;
  o.m4_local = local.covered;
  // Other poses than the calibration's own, and so many that their selection has no effect.
  constexpr int kPoses = 5000;
  std::vector<Eigen::Vector3d> centres;
  for (const auto& t : c.targets) centres.push_back(t.centre_m);
  o.nominal_workspace = {
      c.nominal_workspace_m, c.nominal_workspace_u_m,
      // The calibration's own workspace: within the angles over which functions were learnt.
      nominal_mean_m(
          world.arm, predictor,
          calib::workspace_poses(calib::ArmModel(c.cell.robot, c.cell.tool), kPoses, 97))};
  o.nominal_near = {
      c.nominal_near_targets_m, c.nominal_near_targets_u_m,
      nominal_mean_m(world.arm, predictor, calib::local_poses(model, around, centres, kPoses, 97))};
  return o;
}

namespace {

Stage stage_of(const Trial& trial) {
  Stage stage;
  stage.spheres = trial.spheres;
  stage.touch_sigma_m = stage.noise_m = trial.touch_sigma_m;
  if (trial.noise_m > 0.0) stage.noise_m = trial.noise_m;
  stage.truth.play_arcsec = trial.play_arcsec;
  stage.truth.field_m = trial.field_m;
  stage.truth.field_reach_rad = trial.field_reach_rad;
  stage.truth.length_factor = trial.length_factor;
  stage.truth.angle_factor = trial.angle_factor;
  stage.truth.spring_nm = trial.spring_nm;
  stage.truth.soft_rad = trial.soft_rad;
  stage.truth.compliance_rad_per_nm = trial.compliance_rad_per_nm;
  stage.size = trial.size;
  stage.heavy_stated = trial.heavy_stated;
  stage.lengths = trial.lengths;
  stage.longest_m = trial.longest_m;
  stage.truth.gears = trial.gears;
  stage.truth.gear_arcsec = trial.gear_arcsec;
  stage.outlier_share = trial.outlier_share;
  stage.masses_stated = trial.masses_stated;
  stage.outliers_dropped = trial.outliers_dropped;
  if (!trial.ideal) return stage;
  stage.noise_m = stage.rho_sigma_m = stage.outlier_share = 0.0;
  stage.truth.gears = Gears::kNone;
  stage.truth.compliance_rad_per_nm = 0.0;
  stage.truth.growth = 0.0;
  stage.truth.tip_offset_m = 0.0;
  return stage;
}

}  // namespace

std::optional<Session> measured(const calib::Robot& robot, const Trial& trial, std::uint64_t seed) {
  calib::Random random(seed);
  const calib::Cell nominal = make_cell(robot, stage_of(trial), random);
  calib::PlanOptions plan_options;
  plan_options.fit_touches = trial.fit;
  plan_options.check_touches = trial.check;
  plan_options.criterion = trial.criterion;
  plan_options.seed = static_cast<unsigned>(seed);
  calib::Plan plan;
  try {
    plan = calib::make_plan(as_filed(nominal, stage_of(trial)), plan_options);
  } catch (const calib::PlanError&) {
    return std::nullopt;  // not feasible; another cell is drawn
  }
  Session session{World(nominal, stage_of(trial), random),
                  {},
                  plan.predicted_mean_m,
                  calib::duration_s(plan, robot, {}) / 60.0};
  if (trial.waves_known) state_waves(session.world.arm, session.world.cell.robot);
  if (trial.size_known)
    for (calib::Joint& joint : session.world.cell.robot.joints)
      joint.function_sigma_rad = trial.gear_arcsec * calib::kRadPerArcsec;
  const World& world = session.world;
  World loaded = world;
  const bool carries = trial.touched_kg > 0.0;
  if (carries) {
    session.world.cell.loads = {beside(nominal.tool, trial.touched_kg)};
    loaded.arm.carry(trial.touched_kg, kLoadedComM);
  }
  std::vector<calib::Touch>& touches = session.touches;
  for (std::size_t i = 0; i < plan.touches.size(); ++i) {
    const double warm = static_cast<double>(i) / static_cast<double>(plan.touches.size());
    const bool full = carries && i % 2 == 1;
    auto t = (full ? loaded : world).touch(plan.touches[i], warm, kBeyond, random);
    if (!t) continue;
    if (full) t->load = "full";
    touches.push_back(std::move(*t));
  }
  constexpr int kTimes = 4;
  for (int k = 0, made = 0; made < trial.repeated && k < static_cast<int>(plan.touches.size());
       ++k) {
    // Distributed over the session.
    const auto& planned = plan.touches[static_cast<std::size_t>(k) * 7 % plan.touches.size()];
    if (planned.set != calib::TouchSet::kFit) continue;
    ++made;
    for (int time = 1; time < kTimes; ++time)
      if (auto t = world.touch(planned, 1.0, kBeyond, random)) touches.push_back(std::move(*t));
  }
  return session;
}

std::optional<Outcome> run(const calib::Robot& robot, const Trial& trial, std::uint64_t seed) {
  const auto session = measured(robot, trial, seed);
  if (!session) return std::nullopt;
  Outcome o = judged(session->world, session->touches, trial.load_kg, trial.functions);
  o.planned_m3 = session->planned_m3;
  o.minutes = session->minutes;
  return o;
}

std::optional<OnlineOutcome> run_online(const calib::Robot& robot, const Trial& trial,
                                        const calib::Goal& goal, double failing,
                                        std::uint64_t seed) {
  calib::Random random(seed);
  const calib::Cell nominal = make_cell(robot, stage_of(trial), random);
  const World world(nominal, stage_of(trial), random);
  calib::PlanOptions options;
  options.check_touches = 0;
  options.seed = static_cast<unsigned>(seed);
  std::optional<calib::Online> online;
  try {
    online.emplace(world.cell, options, goal);
  } catch (const calib::PlanError&) {
    return std::nullopt;
  }
  OnlineOutcome result;
  calib::Plan driven;  // for the duration
  calib::JointVector at;
  while (const auto planned = online->next(at)) {
    if (driven.touches.empty()) driven.start = planned->transit.front();
    driven.touches.push_back(*planned);
    at = planned->clear;
    const double warm = std::min(1.0, static_cast<double>(driven.touches.size()) / 100.0);
    // The arm's first millimetre is no search (session's rule), nor is anything beyond the line.
    auto t = random.uniform() < failing ? std::nullopt : world.touch(*planned, warm, 0.0, random);
    if (!t) {
      online->failed();
      continue;
    }
    online->touched(*t);
    result.u95_by_touch_m.push_back(online->progress().u95_m);
    result.minutes_by_touch.push_back(calib::duration_s(driven, robot, {}) / 60.0);
  }
  const calib::Progress& end = online->progress();
  result.touches = end.touches;
  result.failed = static_cast<int>(driven.touches.size()) - end.touches;
  result.u95_m = end.u95_m;
  result.why = words(calib::why_ended(end, goal));
  if (online->touches().empty()) return std::nullopt;
  result.outcome = judged(world, online->touches(), trial.load_kg);
  result.outcome.planned_m3 = end.mean_m;
  result.outcome.minutes = calib::duration_s(driven, robot, {}) / 60.0;
  return result;
}

double median(std::vector<double> v) {
  std::sort(v.begin(), v.end());
  return v.empty() ? 0.0 : v[v.size() / 2];
}

}  // namespace cellcal::experiments
