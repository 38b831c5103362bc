#include "tests/experiments/session.h"

#include <fmt/format.h>

#include "calib/plan/plan.h"

namespace cellcal::experiments {

namespace {

calib::Cell make_cell(const calib::Robot& robot, const SessionSettings& settings,
                      calib::Random& random) {
  calib::Cell cell;
  cell.robot = robot;
  cell.tool.tcp.translation() = Eigen::Vector3d(0.0599, 0.0505, 0.4103);
  cell.tool.mass_kg = 1.535;
  cell.tool.com_m = cell.tool.tcp.translation() / 2.0;
  cell.tool.length_m = cell.tool.tcp.translation().norm();
  cell.tool.deflection_sigma = 0.003;
  cell.touch_sigma_m = settings.touch_sigma_m;
  cell.radius_offset_sigma_m = 0.3e-3;
  // Spread around the front of the arm, low and high; each cell a little different.
  constexpr double kPlaces[][3] = {{1.05, 0.24, 0.35},  {0.85, -0.55, 0.15}, {0.80, 0.45, 0.70},
                                   {0.95, -0.35, 0.75}, {0.65, 0.75, 0.30},  {0.70, -0.75, 0.55}};
  for (int i = 0; i < settings.spheres; ++i) {
    calib::Target t;
    t.id = fmt::format("S{}", i + 1);
    t.diameter_m = 0.0614;
    t.diameter_sigma_m = 2e-6;
    t.has_centre = true;
    t.centre_sigma_m = 0.02;
    for (int k = 0; k < 3; ++k) t.centre_m[k] = kPlaces[i][k] + random.uniform(-0.05, 0.05);
    cell.targets.push_back(t);
  }
  return cell;
}

/// Along the planned search line to where the true tip is `reading_m` outside of the surface.
std::optional<calib::JointVector> touch(const TrueArm& arm, const calib::PlannedTouch& plan,
                                        const Eigen::Vector3d& centre, double radius_m,
                                        double warm) {
  const auto at = [&](double s) {
    calib::JointVector q(plan.standoff.size());
    for (std::size_t i = 0; i < q.size(); ++i)
      q[i] = plan.standoff[i] + s * (plan.end[i] - plan.standoff[i]);
    return q;
  };
  const auto gap = [&](double s) { return (arm.tip(at(s), warm) - centre).norm() - radius_m; };
  double out = -0.5, in = 1.5;  // wider than a session's window: the arms here are not chosen
  if (gap(out) < 0.0 || gap(in) > 0.0) return std::nullopt;
  for (int k = 0; k < 50; ++k) {
    const double middle = (out + in) / 2.0;
    (gap(middle) > 0.0 ? out : in) = middle;
  }
  return at(out);
}

/// The spheres' touches mixed, as if the arm went from one to the other all the time.
void mix(std::vector<calib::PlannedTouch>& touches, calib::Random& random) {
  for (std::size_t i = touches.size(); i > 1; --i)
    std::swap(touches[i - 1], touches[random.below(i)]);
}

}  // namespace

std::optional<PlannedSession> plan_session(const calib::Robot& robot,
                                           const SessionSettings& settings, std::uint64_t seed) {
  calib::Random random(seed);
  const calib::Cell cell = make_cell(robot, settings, random);
  calib::PlanOptions options;
  options.fit_touches = settings.fit;
  options.check_touches = settings.check;
  options.seed = static_cast<unsigned>(seed);
  try {
    return PlannedSession{cell, calib::make_plan(cell, options), random};
  } catch (const calib::PlanError&) {
    return std::nullopt;  // a cell that cannot be served; another is drawn
  }
}

Session carry_out(PlannedSession planned, const SessionSettings& settings) {
  auto& [cell, plan, random] = planned;
  Session session{cell, TrueArm(cell, settings.truth, random), {}, 0.0, {}};
  const Eigen::Vector3d shift(random.normal() * 1e-3, random.normal() * 1e-3,
                              random.normal() * 1e-3);
  for (const calib::Target& t : cell.targets) session.centre_m.push_back(t.centre_m + shift);
  const auto& centre = session.centre_m;
  if (settings.lengths)
    for (std::size_t a = 0; a < centre.size(); ++a)
      for (std::size_t b = a + 1; b < centre.size(); ++b)
        session.cell.lengths.push_back({cell.targets[a].id, cell.targets[b].id,
                                        (centre[a] - centre[b]).norm() + 5e-6 * random.normal(),
                                        5e-6});
  session.rho_m = 0.3e-3 * random.normal();
  if (settings.mixed) mix(plan.touches, random);

  std::vector<int> fit_of(cell.targets.size(), 0), made_of = fit_of;
  for (const calib::PlannedTouch& p : plan.touches)
    fit_of[cell.target_index(p.target)] += p.set == calib::TouchSet::kFit;
  for (std::size_t i = 0; i < plan.touches.size(); ++i) {
    const calib::PlannedTouch& p = plan.touches[i];
    const std::size_t target = cell.target_index(p.target);
    const double warm = static_cast<double>(i) / static_cast<double>(plan.touches.size());
    calib::Touch t;
    t.target = p.target;
    t.set = p.set;
    double radius = cell.targets[target].diameter_m / 2.0 + session.rho_m;
    radius += settings.touch_sigma_m * random.normal();
    if (t.set == calib::TouchSet::kFit && random.uniform() < settings.outlier_share)
      radius += (random.uniform() < 0.7 ? 1.0 : -1.0) * random.uniform(0.2e-3, 3e-3);
    Eigen::Vector3d at = centre[target];
    if (settings.move && settings.move->sphere == target &&
        made_of[target] >= settings.move->when * fit_of[target])
      at += settings.move->shift_m;
    made_of[target] += p.set == calib::TouchSet::kFit;
    const auto q = touch(session.arm, p, at, radius, warm);
    if (!q) continue;
    t.joint_rad = *q;
    session.touches.push_back(std::move(t));
  }
  return session;
}

}  // namespace cellcal::experiments
