#include "calib/estimate/problem.h"

#include <numeric>
#include <variant>

#include "calib/estimate/parallel.h"
#include "calib/model/error.h"
#include "calib/model/units.h"

namespace cellcal::calib {

namespace {

using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// Without a prior a target is expected within a few of these of its estimate from the touches.
constexpr double kPlaceScaleM = 0.01;
constexpr double kTurnScaleRad = 0.01;
/// Prior sigma of a plane's tilt, far beyond any error of touches or cell file. Determines the tilt
/// if all touches are in one spot.
constexpr double kWildTiltRad = 0.5;

/// True if the tip's circuit closes on the target's surface, at the instant that is latched.
bool has_a_surface(TargetKind kind) {
  return kind == TargetKind::kSphere || kind == TargetKind::kPlane;
}

/// Place stated in the cell file; where none is stated, `start`.
TargetPlace stated_place(const Target& target, TargetPlace start) {
  if (target.has_centre && target.kind != TargetKind::kTracker) start.centre_m = target.centre_m;
  if (target.has_normal) start.axes.col(2) = target.normal;
  return start;
}

/// The k-th unknown of a target's place (target.h).
ParameterKey place_parameter(const Target& target, std::size_t t, int k) {
  constexpr int kAxes = 3;
  if (target.kind != TargetKind::kPlane)
    return k < kAxes ? target_parameter(ParameterKind::kCentre, t, k)
                     : target_parameter(ParameterKind::kTurn, t, k - kAxes);
  constexpr int kTilts = 2;
  return k < kTilts ? target_parameter(ParameterKind::kTilt, t, k)
                    : target_parameter(ParameterKind::kShift, t);
}

}  // namespace

Problem::Problem(const Cell& cell, const ArmModel& arm, std::span<const Touch> touches,
                 const std::vector<TargetPlace>& places, double ripple_rad)
    : cell_(cell),
      arm_(arm),
      touches_(touches),
      places_(places),
      nominal_(arm.errors(nullptr)),
      usual_sigma_m_(cell.touch_sigma_m) {
  for (const ArmParameter& parameter : arm.parameters())
    unknowns_.push_back(
        {parameter, parameter.unit, parameter.to_unit, 0.0, 0.0, parameter.sigma, 0.0, 1.0});
  add_rho();
  add_delay();
  shared_size_ = static_cast<int>(unknowns_.size());
  if (arm.size() == 0)
    throw IdentifyError(
        IdentifyError::Kind::kCell,
        "nothing to identify: every tolerance in the robot file is 0; give the joints tolerances");

  block_of_target_.assign(cell.targets.size(), -1);
  std::vector<bool> fitted(cell.targets.size(), false);
  for (const Touch& touch : touches)
    if (touch.set == TouchSet::kFit) fitted[cell.target_index(touch.target)] = true;
  for (std::size_t t = 0; t < cell.targets.size(); ++t) {
    if (!fitted[t]) continue;
    block_of_target_[t] = static_cast<int>(blocks_.size());
    add_target(t);
  }
  weigh_from(0);
  set_ripple(ripple_rad);
  add_lengths();
}

/// One rho per tip, as the contact point is a property of the tip: of the first tip always, of
/// others if they touched a surface.
void Problem::add_rho() {
  rho_.assign(static_cast<std::size_t>(arm_.tool_count()), -1);
  if (!(cell_.radius_offset_sigma_m > 0.0)) return;
  std::vector<bool> touched(rho_.size(), false);
  touched.front() = true;
  if (touched.size() > 1)
    for (const Touch& touch : touches_)
      if (touch.set == TouchSet::kFit &&
          has_a_surface(cell_.targets[cell_.target_index(touch.target)].kind))
        touched[static_cast<std::size_t>(arm_.tool_index(touch.tool))] = true;
  for (std::size_t tool = 0; tool < touched.size(); ++tool) {
    if (!touched[tool]) continue;
    rho_[tool] = static_cast<int>(unknowns_.size());
    unknowns_.push_back({tool_parameter(ParameterKind::kEffectiveRadius, tool), "mm", kMmPerM, 0.0,
                         0.0, cell_.radius_offset_sigma_m, 0.0, 1.0, true});
  }
}

/// One delay, as the wire is common to all tips. None without a speed.
void Problem::add_delay() {
  if (std::none_of(touches_.begin(), touches_.end(),
                   [&](const Touch& touch) { return lacks_delay_of(touch); }))
    return;
  delay_ = static_cast<int>(unknowns_.size());
  unknowns_.push_back({latch_delay_parameter(), "ms", kMsPerS, cell_.latch_delay_s,
                       cell_.latch_delay_s, cell_.latch_delay_sigma_s, 0.0, 1.0, true});
}

bool Problem::lacks_delay_of(const Touch& touch) const {
  return delay_ < 0 && cell_.latch_delay_sigma_s > 0.0 && touch.set == TouchSet::kFit &&
         touch.speed_m_s > 0.0 &&
         has_a_surface(cell_.targets[cell_.target_index(touch.target)].kind);
}

void Problem::extend(std::span<const Touch> touches) {
  const std::size_t before = poses_.size();
  touches_ = touches.first(before);  // the range's memory may have moved, even if extend() fails
  for (std::size_t i = before; i < touches.size(); ++i)
    if (block_of_target_[cell_.target_index(touches[i].target)] < 0)
      throw IdentifyError(IdentifyError::Kind::kTouches, touches[i].target,
                          "target " + touches[i].target + " was not touched before");
  touches_ = touches;
  try {
    weigh_from(before);
  } catch (...) {
    resize(before);
    touches_ = touches.first(before);
    throw;
  }
  for (std::size_t i = before; i < touches.size(); ++i) sigma_m_[i] = sigma_m(i, ripple_rad_);
}

void Problem::weigh_from(std::size_t first) {
  resize(touches_.size());
  by_parts(touches_.size() - first, [&](std::size_t, std::size_t begin, std::size_t behind) {
    for (std::size_t i = first + begin; i < first + behind; ++i) weigh(i);
  });
}

void Problem::resize(std::size_t count) {
  target_of_.resize(count);
  block_of_.resize(count);
  residuals_.resize(count);
  poses_.resize(count);
  lever_m_.resize(count);
  closing_m_s_.resize(count);
  own_sigma_m_.resize(count);
  times_.resize(count, 1);
  const std::size_t before = std::min(first_.size(), count);
  first_.resize(count);
  std::iota(first_.begin() + static_cast<std::ptrdiff_t>(before), first_.end(), before);
  sigma_m_.resize(count);
}

/// Sets the data of a touch that do not depend on the unknowns.
void Problem::weigh(std::size_t i) {
  const Touch& touch = touches_[i];
  target_of_[i] = cell_.target_index(touch.target);
  block_of_[i] = block_of_target_[target_of_[i]];
  const bool has_turns =
      block_of_[i] >= 0 && blocks_[static_cast<std::size_t>(block_of_[i])].has_turns;
  const int tool = arm_.tool_index(touch.tool);
  const Target& target = cell_.targets[target_of_[i]];
  residuals_[i] = residual_of(touch, target, nominal_radius_m(target, tool), has_turns);
  poses_[i] = pose_of(arm_, touch, target);
  ArmChain chain;
  arm_.walk(poses_[i], nominal_, chain);
  Eigen::Matrix3Xd by_joint(3, arm_.joint_count());
  const auto first = static_cast<int>(cell_.robot.first_turning());
  by_joint.leftCols(first).setZero();
  for (int k = first; k < arm_.joint_count(); ++k)
    by_joint.col(k) = chain.link[k].z.cross(chain.tip - chain.link[k].z_origin);
  const TargetPlace& place = places_[target_of_[i]];
  const Eigen::Vector3d normal = cell_.targets[target_of_[i]].kind == TargetKind::kPlane
                                     ? Eigen::Vector3d(place.axes.col(2))
                                     : (chain.tip - place.centre_m).stableNormalized();
  // (24), lam: three components see all three directions; each gets a third of the square.
  lever_m_[i] =
      rows(i) >= 3 ? by_joint.norm() / std::sqrt(3.0) : (normal.transpose() * by_joint).norm();
  own_sigma_m_[i] = touch.sigma_m > 0.0 ? touch.sigma_m : usual_sigma_m_;
  // (74), v_l cos: by the nominal arm, whose error of a degree is negligible for the latch delay.
  const bool closes = touch.speed_m_s > 0.0 && has_a_surface(cell_.targets[target_of_[i]].kind);
  double cosine = 1.0;
  if (touch.approach) {
    Eigen::Vector3d along = Eigen::Map<const Eigen::Vector3d>(touch.approach->data());
    if (target.carried_by > 0)
      along = carried_at(cell_.robot, carrier_rad(touch, target)).linear().transpose() * along;
    cosine = -normal.dot(along);
  }
  closing_m_s_[i] = closes ? touch.speed_m_s * cosine : 0.0;
}

void Problem::add_target(std::size_t t) {
  const Target& target = cell_.targets[t];
  const bool poses = std::any_of(touches_.begin(), touches_.end(), [&](const Touch& touch) {
    return touch.tracker_abc_rad && touch.set == TouchSet::kFit && touch.target == target.id;
  });
  const TargetBlock block{t, static_cast<int>(unknowns_.size()), place_size(target.kind),
                          target.kind == TargetKind::kSphere && target.diameter_sigma_m > 0.0,
                          target.kind == TargetKind::kTracker && poses};
  const TargetPlace& start = places_[t];
  const Eigen::VectorXd origin = unknowns_at(target.kind, start, start);
  const Eigen::VectorXd stated = unknowns_at(target.kind, start, stated_place(target, start));
  const bool plane = target.kind == TargetKind::kPlane;
  for (int k = 0; k < block.place; ++k) {
    const bool turns = plane ? k < 2 : k >= 3;
    Unknown unknown{place_parameter(target, t, k),
                    turns ? "deg" : "mm",
                    turns ? kDegPerRad : kMmPerM,
                    stated[k],
                    origin[k],
                    turns ? kTurnScaleRad : kPlaceScaleM};
    double sigma = 0.0;  // no prior for a tracker's frame
    if (plane && turns)
      sigma = target.normal_sigma_rad > 0.0 ? target.normal_sigma_rad : kWildTiltRad;
    else if (target.has_centre && target.kind != TargetKind::kTracker)
      sigma = target.centre_sigma_m;
    if (sigma > 0.0) {
      unknown.prior_mean_u = (stated[k] - origin[k]) / unknown.scale;
      unknown.prior_weight = unknown.scale / sigma;
    }
    unknowns_.push_back(unknown);
  }
  if (block.has_radius)
    unknowns_.push_back({target_parameter(ParameterKind::kRadius, t), "mm", kMmPerM, 0.0, 0.0,
                         target.diameter_sigma_m / 2.0, 0.0, 1.0, true});
  // Determined by the touches; without any in use it keeps its prior.
  constexpr double kWildTurnRad = 1.0;
  for (int k = 0; block.has_turns && k < 3; ++k)
    unknowns_.push_back({target_parameter(ParameterKind::kProbeTurn, t, k), "deg", kDegPerRad, 0.0,
                         0.0, kTurnScaleRad, 0.0, kTurnScaleRad / kWildTurnRad});
  blocks_.push_back(block);
}

void Problem::add_lengths() {
  for (const CertifiedLength& length : cell_.lengths) {
    const std::size_t from = cell_.target_index(length.from), to = cell_.target_index(length.to);
    for (const std::size_t end : {from, to})
      if (!has_a_centre(cell_.targets[end].kind))
        throw IdentifyError(
            IdentifyError::Kind::kCell, cell_.targets[end].id,
            "a length ends at " + cell_.targets[end].id +
                ", which has no centre; lengths lie between spheres, wires and points");
    const int a = block_of_target_[from], b = block_of_target_[to];
    if (a >= 0 && b >= 0)
      lengths_.push_back({a, b, length.length_m, length.sigma_m, length.is_check});
  }
}

void Problem::set_repeats(std::vector<int> times, std::vector<std::size_t> first, double sigma_m) {
  times_ = std::move(times);
  first_ = std::move(first);
  set_noise(sigma_m);
}

void Problem::set_noise(double sigma_m) {
  for (std::size_t i = 0; i < own_sigma_m_.size(); ++i)
    if (!(touches_[i].sigma_m > 0.0)) own_sigma_m_[i] = sigma_m;
  usual_sigma_m_ = sigma_m;
  set_ripple(ripple_rad_);
}

void Problem::set_ripple(double ripple_rad) {
  ripple_rad_ = ripple_rad;
  sigma_m_.resize(own_sigma_m_.size());
  for (std::size_t i = 0; i < sigma_m_.size(); ++i) sigma_m_[i] = sigma_m(i, ripple_rad);
}

double Problem::sigma_m(std::size_t touch, double ripple_rad) const {
  const double sigma = std::hypot(own_sigma_m_[touch], ripple_rad * joint_lever_m(touch));  // (24)
  return field_m_ > 0.0 ? std::hypot(sigma, field_m_) : sigma;
}

void Problem::set_field(double field_m, double noise_factor) {
  field_m_ = field_m;
  usual_sigma_m_ *= noise_factor;
  for (double& sigma : own_sigma_m_) sigma *= noise_factor;
  set_ripple(ripple_rad_);
}

int Problem::rows(std::size_t touch) const { return rows_of(residuals_[touch]); }

double Problem::turn_lever_m(std::size_t touch) const {
  const double own = touches_[touch].turn_sigma_rad;
  return own_sigma_m_[touch] / (own > 0.0 ? own : cell_.turn_sigma_rad);
}

double Problem::nominal_radius_m(const Target& target, int tool) const {
  const double tip_m = arm_.tool(tool).tip_radius_m;
  return target.kind == TargetKind::kSphere  ? target.diameter_m / 2.0 + tip_m
         : target.kind == TargetKind::kPlane ? tip_m
                                             : 0.0;
}

Problem::At Problem::at(const double* x_si) const {
  At at{x_si, arm_.errors(x_si), {}, delay_ >= 0 ? x_si[delay_] : cell_.latch_delay_s};
  for (std::size_t tool = 0; tool < rho_.size(); ++tool)
    at.rho_m[tool] = rho_[tool] >= 0 ? x_si[rho_[tool]] : 0.0;
  return at;
}

void Problem::residual_m(std::size_t touch, const At& at, double* residual, double* by_shared,
                         double* by_target, Eigen::Vector3d* direction) const {
  ArmChain chain;
  arm_.walk(poses_[touch], at.arm, chain);
  const Rows rows{residual, by_shared, by_target, direction};
  std::visit([&](const auto& kind) { fill(kind, touch, at, chain, rows); }, residuals_[touch]);
}

void Problem::fill(const DistanceResidual& kind, std::size_t touch, const At& at,
                   const ArmChain& chain, const Rows& rows) const {
  const double* own = at.x + blocks_[static_cast<std::size_t>(block_of_[touch])].first;
  const int tool = tool_of(touch);
  const Distance distance = kind.distance(places_[target_of_[touch]], own, chain.tip);
  const double radius = kind.radius_m(at.rho_m[static_cast<std::size_t>(tool)], own);
  *rows.residual = distance.m - radius + closing_m_s_[touch] * at.delay_s;  // (12), (74)
  if (rows.direction != nullptr) *rows.direction = distance.normal;
  if (rows.by_shared != nullptr) {
    arm_.derivative_along(distance.normal, poses_[touch], at.arm, chain, rows.by_shared);
    std::fill(rows.by_shared + arm_.size(), rows.by_shared + shared_size_, 0.0);
    if (kind.has_surface() && rho(tool) >= 0) rows.by_shared[rho(tool)] = -1.0;
    if (delay_ >= 0) rows.by_shared[delay_] = closing_m_s_[touch];
  }
  if (rows.by_target != nullptr) {
    Eigen::Map<Eigen::RowVector3d>{rows.by_target} = distance.by_place;
    if (kind.has_own_radius) rows.by_target[3] = -1.0;
  }
}

void Problem::fill(const PositionResidual& kind, std::size_t touch, const At& at,
                   const ArmChain& chain, const Rows& rows) const {
  const TargetBlock& block = blocks_[static_cast<std::size_t>(block_of_[touch])];
  const SeenTip seen =
      kind.seen(places_[block.target], at.x + block.first, rows.by_target != nullptr);
  const Eigen::Vector3d offset = chain.tip - seen.m;
  Eigen::Map<Eigen::Vector3d>{rows.residual} = offset;  // (12)
  if (rows.direction != nullptr) *rows.direction = direction_of(offset);
  for (int axis = 0; rows.by_shared != nullptr && axis < 3; ++axis) {
    double* row = rows.by_shared + axis * shared_size_;
    arm_.derivative_along(Eigen::Vector3d::Unit(axis), poses_[touch], at.arm, chain, row);
    std::fill(row + arm_.size(), row + shared_size_, 0.0);
  }
  if (rows.by_target != nullptr) {
    Eigen::Map<RowMajor> by(rows.by_target, 3, block.size());
    by.setZero();
    by.leftCols(block.place) = -seen.by_place.leftCols(block.place);
  }
  if (kind.has_turns) fill_turn(kind, touch, at, chain, rows);
}

/// Fills the rotation rows, after the three of the position.
void Problem::fill_turn(const PositionResidual& kind, std::size_t touch, const At& at,
                        const ArmChain& chain, const Rows& rows) const {
  const TargetBlock& block = blocks_[static_cast<std::size_t>(block_of_[touch])];
  const bool derivatives = rows.by_shared != nullptr || rows.by_target != nullptr;
  const ProbeTurn turn =
      probe_turn(kind, places_[block.target], at.x + block.first,
                 arm_.rotation(poses_[touch], at.arm, chain), turn_lever_m(touch), derivatives);
  Eigen::Map<Eigen::Vector3d>{rows.residual + 3} = turn.m;
  if (rows.by_shared != nullptr) {
    Eigen::Matrix3Xd by_arm(3, arm_.size());
    arm_.turn_derivative(poses_[touch], at.arm, chain, by_arm);
    Eigen::Map<RowMajor> by(rows.by_shared + 3 * shared_size_, 3, shared_size_);
    by.leftCols(arm_.size()) = turn.by_tool * by_arm;
    by.rightCols(shared_size_ - arm_.size()).setZero();
  }
  if (rows.by_target != nullptr) {
    Eigen::Map<RowMajor> by(rows.by_target + 3 * TargetBlock::kMost, 3, TargetBlock::kMost);
    by.leftCols<3>().setZero();
    by.middleCols<3>(3) = turn.by_frame;
    by.rightCols<3>() = turn.by_mount;
  }
}

Eigen::VectorXd Problem::to_si(const Eigen::VectorXd& u) const {
  Eigen::VectorXd x(size());
  for (int i = 0; i < size(); ++i) x[i] = unknowns_[i].origin + unknowns_[i].scale * u[i];
  return x;
}

Eigen::VectorXd Problem::to_u(const Eigen::VectorXd& x) const {
  Eigen::VectorXd u(size());
  for (int i = 0; i < size(); ++i) u[i] = (x[i] - unknowns_[i].origin) / unknowns_[i].scale;
  return u;
}

Eigen::VectorXd Problem::scales() const {
  Eigen::VectorXd scale(size());
  for (int i = 0; i < size(); ++i) scale[i] = unknowns_[i].scale;
  return scale;
}

}  // namespace cellcal::calib
