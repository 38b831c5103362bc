#include "tests/experiments/trial.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "calib/identify/identify.h"
#include "calib/identify/predict.h"
#include "calib/identify/region.h"
#include "calib/model/random.h"
#include "calib/plan/duration.h"

namespace cellcal::experiments {

namespace {

calib::Cell make_cell(const calib::Robot& robot, const Trial& trial, calib::Random& random) {
  calib::Cell cell;
  cell.robot = robot;
  cell.tool.tcp.translation() = Eigen::Vector3d(0.0599, 0.0505, 0.4103);
  cell.tool.mass_kg = 1.535;
  cell.tool.com_m = cell.tool.tcp.translation() / 2.0;
  cell.tool.length_m = cell.tool.tcp.translation().norm();
  cell.tool.deflection_sigma = 0.003;
  cell.touch_sigma_m = trial.touch_sigma_m;
  cell.radius_offset_sigma_m = trial.ideal ? 1e-9 : 0.3e-3;
  // Spread around the front of the arm, low and high; each cell a little different.
  constexpr double kPlaces[][3] = {{1.05, 0.24, 0.35},  {0.85, -0.55, 0.15}, {0.80, 0.45, 0.70},
                                   {0.95, -0.35, 0.75}, {0.65, 0.75, 0.30},  {0.70, -0.75, 0.55}};
  for (int i = 0; i < trial.spheres; ++i) {
    calib::Target t;
    t.id = fmt::format("S{}", i + 1);
    t.diameter_m = 0.0614;
    t.diameter_sigma_m = 2e-6;
    t.has_centre = true;
    t.centre_sigma_m = 0.02;
    for (int k = 0; k < 3; ++k) t.centre_m[k] = kPlaces[i][k] + random.uniform(-0.05, 0.05);
    cell.targets.push_back(t);
  }
  // The plan has to know which lengths are certified, not yet how long they are.
  constexpr double kLengthSigmaM = 5e-6;
  for (std::size_t a = 0; trial.lengths && a < cell.targets.size(); ++a)
    for (std::size_t b = a + 1; b < cell.targets.size(); ++b)
      cell.lengths.push_back({cell.targets[a].id, cell.targets[b].id,
                              (cell.targets[a].centre_m - cell.targets[b].centre_m).norm(),
                              kLengthSigmaM});
  return cell;
}

/// Along the planned search line to where the true tip is `reading_m` outside of the surface.
std::optional<calib::JointVector> meet(const TrueArm& arm, const calib::PlannedTouch& plan,
                                       const Eigen::Vector3d& centre, double radius_m, double warm,
                                       double beyond) {
  const auto at = [&](double s) {
    calib::JointVector q(plan.standoff.size());
    for (std::size_t i = 0; i < q.size(); ++i)
      q[i] = plan.standoff[i] + s * (plan.end[i] - plan.standoff[i]);
    return q;
  };
  const auto gap = [&](double s) { return (arm.tip(at(s), warm) - centre).norm() - radius_m; };
  double out = -beyond, in = 1.0 + beyond;
  if (gap(out) < 0.0 || gap(in) > 0.0) return std::nullopt;
  for (int k = 0; k < 50; ++k) {
    const double middle = (out + in) / 2.0;
    (gap(middle) > 0.0 ? out : in) = middle;
  }
  return at(out);
}

/// Region figures after a 6-DoF alignment.
void judge(const TrueArm& arm, const calib::Predictor& predictor,
           const std::vector<calib::JointVector>& poses, double& mean, double& max, double& rms,
           double& covered, double& u95_mean) {
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
  const Eigen::Matrix4d motion = Eigen::umeyama(predicted, real, false);
  const Eigen::VectorXd e =
      ((motion.topLeftCorner<3, 3>() * predicted).colwise() + motion.topRightCorner<3, 1>() - real)
          .colwise()
          .norm()
          .transpose();
  mean = e.mean();
  max = e.maxCoeff();
  rms = std::sqrt(e.squaredNorm() / static_cast<double>(n));
  covered = static_cast<double>((e.array() <= u95.array()).count()) / static_cast<double>(n);
  u95_mean = u95.mean();
}

/// Postures in which the aims are judged: in front of the arm, as in the cases that the aims were
/// set with. Narrower than what predictions and plans take for the workspace.
std::vector<calib::JointVector> postures(const calib::ArmModel& arm, int count, unsigned seed) {
  constexpr double kLowDeg[] = {-60.0, -120.0, 20.0, -170.0, -110.0, -170.0};
  constexpr double kHighDeg[] = {60.0, -10.0, 145.0, 170.0, 110.0, 170.0};
  constexpr double kFloorM = 0.05;
  if (arm.joint_count() != 6) return calib::workspace_poses(arm, count, seed);
  calib::Random random(seed);
  std::vector<calib::JointVector> poses;
  while (static_cast<int>(poses.size()) < count) {
    calib::JointVector q(6);
    for (std::size_t i = 0; i < q.size(); ++i)
      q[i] = random.uniform(kLowDeg[i], kHighDeg[i]) * std::numbers::pi / 180.0;
    if (arm.nominal_tip_m(q).z() > kFloorM) poses.push_back(std::move(q));
  }
  return poses;
}

/// The cell as it really is.
struct World {
  calib::Cell cell;  ///< as its file says
  TrueArm arm;
  std::vector<Eigen::Vector3d> centre;
  double rho_m;

  World(const calib::Cell& nominal, const Trial& trial, calib::Random& random)
      : cell(nominal), arm(nominal, settings(trial), random) {
    const Eigen::Vector3d shift(random.normal() * 1e-3, random.normal() * 1e-3,
                                random.normal() * 1e-3);
    for (const calib::Target& t : nominal.targets) centre.push_back(t.centre_m + shift);
    for (calib::CertifiedLength& length : cell.lengths)
      length.length_m =
          (centre[cell.target_index(length.from)] - centre[cell.target_index(length.to)]).norm() +
          length.sigma_m * random.normal();
    rho_m = trial.ideal ? 0.0 : 0.3e-3 * random.normal();
  }

  static TruthSettings settings(const Trial& trial) {
    TruthSettings s;
    s.gears = trial.gears;
    s.gear_arcsec = trial.gear_arcsec;
    if (trial.ideal) {
      s.gears = Gears::kNone;
      s.compliance_rad_per_nm = 0.0;
      s.growth = 0.0;
      s.tip_offset_m = 0.0;
    }
    return s;
  }

  /// Empty where the search line does not meet the sphere. `beyond`: shares of the search line that
  /// are searched before its begin and after its end.
  std::optional<calib::Touch> touch(const calib::PlannedTouch& planned, const Trial& trial,
                                    double warm, double beyond, calib::Random& random) const {
    const std::size_t target = cell.target_index(planned.target);
    calib::Touch t;
    t.target = planned.target;
    t.set = planned.set;
    double radius = cell.targets[target].diameter_m / 2.0 + rho_m;
    radius += trial.ideal ? 0.0 : trial.touch_sigma_m * random.normal();
    constexpr double kOutlierShare = 0.02;
    if (!trial.ideal && t.set == calib::TouchSet::kFit && random.uniform() < kOutlierShare)
      radius += (random.uniform() < 0.7 ? 1.0 : -1.0) * random.uniform(0.2e-3, 3e-3);
    const auto q = meet(arm, planned, centre[target], radius, warm, beyond);
    if (!q) return std::nullopt;
    t.joint_rad = *q;
    return t;
  }

  Outcome judged(const std::vector<calib::Touch>& touches) const {
    const calib::Calibration c = calib::identify(cell, touches);
    const calib::Predictor predictor(c);
    Outcome o;
    o.m1 = c.check.mean_m;
    o.m1_max = c.check.max_m;
    o.published = c.verdict.publish;
    if (!o.published && !c.verdict.reasons.empty()) o.why_not = c.verdict.reasons.front();
    for (const auto& t : c.targets)
      o.rho_error = std::max(o.rho_error, std::abs(t.effective_radius_m - 0.0307 - rho_m));
    const calib::ArmModel model(cell.robot, cell.tool);
    double rms = 0, u95 = 0;
    judge(arm, predictor, postures(model, 1000, 99), o.m3, o.m3_max, rms, o.m4, u95);
    o.ratio = u95 / rms;
    o.predicted_m3 = c.predicted_m3_m;
    std::vector<calib::JointVector> around;
    for (const auto& t : touches) around.push_back(t.joint_rad);
    judge(arm, predictor, calib::local_poses(model, around, centre, 0.15, 300, 98), o.m2, o.m2_max,
          rms, o.m4_local, u95);
    return o;
  }
};

}  // namespace

std::optional<Outcome> run(const calib::Robot& robot, const Trial& trial, std::uint64_t seed) {
  calib::Random random(seed);
  const calib::Cell nominal = make_cell(robot, trial, random);
  calib::PlanOptions plan_options;
  plan_options.fit_touches = trial.fit;
  plan_options.check_touches = trial.check;
  plan_options.criterion = trial.criterion;
  plan_options.seed = static_cast<unsigned>(seed);
  calib::Plan plan;
  try {
    plan = calib::make_plan(nominal, plan_options);
  } catch (const calib::PlanError&) {
    return std::nullopt;  // a cell that cannot be served; another is drawn
  }
  const World world(nominal, trial, random);
  constexpr double kBeyond = 0.5;  // wider than a session's window: the arms here are not chosen
  std::vector<calib::Touch> touches;
  for (std::size_t i = 0; i < plan.touches.size(); ++i) {
    const double warm = static_cast<double>(i) / static_cast<double>(plan.touches.size());
    if (auto t = world.touch(plan.touches[i], trial, warm, kBeyond, random))
      touches.push_back(std::move(*t));
  }
  Outcome o = world.judged(touches);
  o.planned_m3 = plan.predicted_m3_m;
  o.minutes = calib::duration_s(plan, robot, {}) / 60.0;
  return o;
}

std::optional<OnlineOutcome> run_online(const calib::Robot& robot, const Trial& trial,
                                        const calib::Goal& goal, double failing,
                                        std::uint64_t seed) {
  calib::Random random(seed);
  const calib::Cell nominal = make_cell(robot, trial, random);
  const World world(nominal, trial, random);
  calib::PlanOptions options;
  options.seed = static_cast<unsigned>(seed);
  std::optional<calib::Online> online;
  try {
    online.emplace(world.cell, options, goal, calib::JointVector{});
  } catch (const calib::PlanError&) {
    return std::nullopt;
  }
  OnlineOutcome result;
  calib::Plan driven;  // for the time it took
  calib::JointVector at;
  while (const auto planned = online->next(at)) {
    if (driven.touches.empty()) driven.start = planned->transit.front();
    driven.touches.push_back(*planned);
    at = planned->clear;
    const double warm = std::min(1.0, static_cast<double>(driven.touches.size()) / 100.0);
    // The arm's first millimetre is no search (session's rule), and there is no more than the line.
    auto t =
        random.uniform() < failing ? std::nullopt : world.touch(*planned, trial, warm, 0.0, random);
    if (t)
      online->touched(*t);
    else
      online->failed();
  }
  const calib::Progress& end = online->progress();
  result.touches = end.touches;
  result.failed = static_cast<int>(driven.touches.size()) - end.touches;
  result.u95_m = end.u95_m;
  result.why = end.why;
  if (online->touches().empty()) return std::nullopt;
  result.outcome = world.judged(online->touches());
  result.outcome.planned_m3 = end.mean_m;
  result.outcome.minutes = calib::duration_s(driven, robot, {}) / 60.0;
  return result;
}

double median(std::vector<double> v) {
  std::sort(v.begin(), v.end());
  return v.empty() ? 0.0 : v[v.size() / 2];
}

}  // namespace cellcal::experiments
