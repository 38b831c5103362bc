#include "sim/cell/truth.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "calib/model/inverse.h"
#include "calib/model/units.h"
#include "sim/cell/physical_cell.h"

namespace cellcal::sim {

namespace {

/// Bound on drawn errors: no arm is delivered five sigma off nominal.
constexpr double kLargestTruthSigma = 2.5;

/// Independent of the arm's errors.
constexpr std::uint64_t kHiddenTruthSeedOffset = 15485863;
/// Load that closes most of an elastic backlash.
constexpr double kPlayClosesNm = 20.0;
/// Fast waves of a joint, and their orders per turn.
constexpr std::size_t kWaves = 6;
constexpr int kLowestWave = 5, kHighestWave = 35;

double bounded_normal(calib::Random& random) {
  return std::clamp(random.normal(), -kLargestTruthSigma, kLargestTruthSigma);
}

/// 1 sigma of each amplitude of the fast waves [rad].
double wave_sigma_rad(const TruthOptions& options) {
  return options.wave_arcsec * calib::kRadPerArcsec / std::sqrt(1.0 * kWaves);
}

bool is_fast(const TruthOptions& options, const calib::ArmParameter& parameter) {
  return options.wave_arcsec > 0.0 && parameter.harmonic >= kLowestWave;
}

/// Slow orders with the stated sigma; drawn_errors() gives the fast ones their own.
void add_gear(const TruthOptions& options, calib::Random& random, calib::Joint& joint) {
  if (!(options.gear_arcsec > 0.0) && !(options.wave_arcsec > 0.0)) return;
  joint.gear_ratio = 1.0;
  joint.harmonics.clear();
  if (options.gear_arcsec > 0.0) joint.harmonics = {1, 2};
  joint.harmonic_sigma_rad = options.gear_arcsec > 0.0 ? options.gear_arcsec * calib::kRadPerArcsec
                                                       : wave_sigma_rad(options);
  const std::size_t all = joint.harmonics.size() + (options.wave_arcsec > 0.0 ? kWaves : 0);
  while (joint.harmonics.size() < all) {
    const int order = static_cast<int>(random.uniform(kLowestWave, kHighestWave + 1.0));
    if (std::ranges::find(joint.harmonics, order) == joint.harmonics.end())
      joint.harmonics.push_back(order);
  }
}

calib::ArmModel true_arm(const calib::Cell& cell, const TruthOptions& options) {
  calib::Robot robot = cell.robot;
  calib::Random random(options.seed + kHiddenTruthSeedOffset);
  if (options.compliance_rad_per_nm > 0.0 || options.play_arcsec > 0.0)
    assign_masses(robot, random);
  for (calib::Joint& joint : robot.joints) {
    if (joint.is_prismatic()) continue;
    add_gear(options, random, joint);
    if (options.compliance_rad_per_nm > 0.0)
      joint.compliance_sigma_rad_per_nm = options.compliance_rad_per_nm;
    if (options.play_arcsec > 0.0) {
      joint.play_sigma_rad = options.play_arcsec * calib::kRadPerArcsec;
      joint.play_closes_nm = kPlayClosesNm;
    }
  }
  calib::Tool tool = cell.tool;
  if (options.deflection > 0.0) tool.deflection_sigma = options.deflection;
  for (double& component : tool.tcp.translation())
    component += options.tip_offset_m * random.uniform(-1.0, 1.0);
  return {robot, tool};
}

/// Targets with a place in the cell, in one frame; trackers, and others without a place, may be anywhere.
std::vector<const calib::Target*> placed_targets(const calib::Cell& cell, int carried_by) {
  std::vector<const calib::Target*> placed;
  for (const calib::Target& target : cell.targets)
    if (target.kind != calib::TargetKind::kTracker && (target.has_centre || target.has_box) &&
        target.carried_by == carried_by)
      placed.push_back(&target);
  return placed;
}

/// Angles of the axes that carry a frame while it is taught.
std::vector<double> taught_rad(const calib::Robot& robot, int carried_by) {
  std::vector<double> angles;
  for (const calib::PositionerAxis& axis :
       std::span(robot.positioner).first(static_cast<std::size_t>(carried_by)))
    angles.push_back(std::clamp(0.0, axis.min_rad, axis.max_rad));
  return angles;
}

using Eigen::AngleAxisd, Eigen::Quaterniond, Eigen::Vector3d;
constexpr int kViews = 6;  // about a direction in which a place is taught

/// Orientations of the TCP in which a place is taught: its z axis down, turned about it; or the tool itself down, whose
/// direction some TCPs state as x.
std::vector<Eigen::Matrix3d> taught_orientations(const calib::Cell& cell, bool by_tool) {
  const Quaterniond up = Quaterniond::FromTwoVectors(Vector3d::UnitZ(), calib::up_of(cell.robot));
  const Vector3d shaft = cell.tool.tcp.linear().transpose() * calib::shaft_of(cell.tool);
  std::vector<Eigen::Matrix3d> all;
  for (int view = 0; view < kViews; ++view) {
    const Eigen::Matrix3d down =
        (AngleAxisd(view * 2.0 * std::numbers::pi / kViews, Vector3d::UnitZ()) *
         AngleAxisd(std::numbers::pi, Vector3d::UnitX()))
            .toRotationMatrix();
    all.emplace_back(up.toRotationMatrix() * down);
    if (by_tool)
      all.back() *= Quaterniond::FromTwoVectors(shaft, Vector3d::UnitZ()).toRotationMatrix();
  }
  return all;
}

/// With the tool in 26 directions: under a ceiling, at a wall, or with an arm that does not reach it from above.
std::vector<Eigen::Matrix3d> taught_anyhow(const calib::Cell& cell) {
  const Vector3d shaft = cell.tool.tcp.linear().transpose() * calib::shaft_of(cell.tool);
  std::vector<Eigen::Matrix3d> all;
  for (int k = 0; k < 27; ++k) {
    const Vector3d towards(k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1);
    for (int view = 0; view < kViews && !towards.isZero(); ++view)
      all.emplace_back(AngleAxisd(view * 2.0 * std::numbers::pi / kViews, towards.normalized()) *
                       Quaterniond::FromTwoVectors(shaft, towards));
  }
  return all;
}

/// Position of the real arm's tip with the nominal arm at the centres, in the frame that carries them;
/// mean over several tool orientations, as in teaching.
Eigen::Matrix3Xd taught_places(const Truth& truth, const calib::Cell& cell, int carried_by) {
  const calib::ArmModel nominal(cell.robot, cell.tool);
  const calib::JointVector home = [&] {
    calib::JointVector q(cell.robot.joints.size(), 0.0);
    const std::size_t arm = cell.robot.first_turning();
    if (q.size() >= arm + 5) q[arm + 1] = -1.2, q[arm + 2] = 1.6, q[arm + 4] = 1.0;
    for (std::size_t i = 0; i < q.size(); ++i)
      q[i] = std::clamp(q[i], cell.robot.joints[i].min_rad, cell.robot.joints[i].max_rad);
    return q;
  }();
  const auto targets = placed_targets(cell, carried_by);
  const std::vector<double> carrier_rad = taught_rad(cell.robot, carried_by);
  const Eigen::Isometry3d carried = calib::carried_at(cell.robot, carrier_rad);
  Eigen::Matrix3Xd places(3, static_cast<Eigen::Index>(targets.size()));
  for (std::size_t t = 0; t < targets.size(); ++t) {
    const Eigen::Vector3d centre =
        carried_by > 0 ? carried * targets[t]->centre_m : targets[t]->centre_m;
    const calib::JointVector seed = facing(cell.robot, home, centre);
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    int reached = 0;
    using Orientations = std::vector<Eigen::Matrix3d>(const calib::Cell&);
    for (Orientations* taught :
         {+[](const calib::Cell& c) { return taught_orientations(c, false); },
          +[](const calib::Cell& c) { return taught_orientations(c, true); }, &taught_anyhow}) {
      if (reached > 0) break;
      for (const Eigen::Matrix3d& orientation : taught(cell)) {
        Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
        pose.translation() = centre;
        pose.linear() = orientation;
        const auto q = calib::inverse(nominal, pose, seed, 0.0);
        if (!q) continue;
        sum +=
            truth.arm.position(truth.arm.prepare(*q, 0, nullptr, carrier_rad), truth.errors.data());
        ++reached;
      }
    }
    if (reached == 0)
      throw std::runtime_error("the emulated arm does not reach target " + targets[t]->id +
                               "; move it");
    places.col(static_cast<Eigen::Index>(t)) = sum / reached;
  }
  return places;
}

/// Places spheres randomly in their boxes if only those are known.
calib::Cell with_all_places(calib::Cell cell, std::uint64_t seed) {
  calib::Random random(seed + 7919);  // independent of the draws of the arm
  for (calib::Target& target : cell.targets) {
    if (target.has_centre || !target.has_box) continue;
    for (int k = 0; k < 3; ++k)
      target.centre_m[k] = random.uniform(target.low_m[k], target.high_m[k]);
  }
  return cell;
}

Eigen::VectorXd drawn_errors(const calib::ArmModel& arm, const TruthOptions& options,
                             calib::Random& random) {
  Eigen::VectorXd errors(arm.size());
  for (int i = 0; i < arm.size(); ++i) {
    const calib::ArmParameter& parameter = arm.parameters()[i];
    const double draw = bounded_normal(random);
    switch (parameter.kind) {
      case calib::ParameterKind::kDeflection:
        errors[i] =
            options.deflection >= 0.0 ? options.deflection : parameter.sigma * std::abs(draw);
        break;
      case calib::ParameterKind::kCompliance:
      case calib::ParameterKind::kPlay:  // half, in the direction of the load
        errors[i] = parameter.sigma * std::abs(draw);
        break;
      case calib::ParameterKind::kCosine:
      case calib::ParameterKind::kSine:
        errors[i] =
            (is_fast(options, parameter) ? wave_sigma_rad(options) : parameter.sigma) * draw;
        break;
      case calib::ParameterKind::kTcp: errors[i] = parameter.sigma * draw; break;
      case calib::ParameterKind::kPositioner:
        errors[i] = calib::is_positioner_compliance(parameter)
                        ? parameter.sigma * std::abs(draw)
                        : options.geometry_scale * parameter.sigma * draw;
        break;
      default: errors[i] = options.geometry_scale * parameter.sigma * draw;
    }
  }
  return errors;
}

/// From the cell file's frame to the true one: at the taught places, with an error of the placement's
/// sigmas.
Eigen::Isometry3d artefact_place(const Truth& truth, const calib::Cell& cell, int carried_by,
                                 const TruthOptions& options, calib::Random& random) {
  const Eigen::Matrix3Xd taught = taught_places(truth, cell, carried_by);
  Eigen::Matrix3Xd nominal(3, taught.cols());
  for (Eigen::Index i = 0; i < nominal.cols(); ++i)
    nominal.col(i) = placed_targets(cell, carried_by)[static_cast<std::size_t>(i)]->centre_m;
  const Eigen::Vector3d middle =
      taught.cols() > 0 ? taught.rowwise().mean() : Eigen::Vector3d::Zero().eval();
  Eigen::Isometry3d place = Eigen::Isometry3d::Identity();
  if (nominal.cols() >= 3)  // three points determine a rigid body
    place = calib::rigid_motion(nominal, taught);
  else if (nominal.cols() > 0)
    place.translation() = middle - nominal.rowwise().mean();
  Eigen::Vector3d shift, turn;
  for (int k = 0; k < 3; ++k) shift[k] = options.placement_m * bounded_normal(random);
  for (int k = 0; k < 3; ++k) turn[k] = options.placement_rad * bounded_normal(random);
  if (turn.norm() > 0.0)
    place = Eigen::Translation3d(middle) * Eigen::AngleAxisd(turn.norm(), turn.normalized()) *
            Eigen::Translation3d(-middle) * place;
  place.pretranslate(shift);
  return place;
}

/// Above the distance of any back-off, and below that of every path to another touch.
constexpr double kAwayM = 0.005;
/// Distance at which a new closing is drawn; above the range of the noise.
constexpr double kOpenM = 0.0003;
constexpr double kLargestSigma = 2.5;
constexpr double kLeastChipM = 0.0003, kMostChipM = 0.001;
/// Independent of the draws of the arm.
constexpr std::uint64_t kOwnDraws = 104729;

}  // namespace

double Truth::warm_at(double seconds) const { return 1.0 - std::exp(-seconds / warm_up_s); }

Truth draw_truth(const calib::Cell& stated, const TruthOptions& options) {
  const calib::Cell cell = with_all_places(stated, options.seed);
  Truth truth{true_arm(cell, options), {}, {}, {}};
  truth.growth = options.growth;
  truth.warm_up_s = options.warm_up_s;
  truth.contacts = options.contacts;
  truth.contact_seed = options.seed;
  calib::Random random(options.seed);
  truth.errors = drawn_errors(truth.arm, options, random);
  std::vector<Eigen::Isometry3d> places;
  for (int axes = 0; axes <= static_cast<int>(cell.robot.positioner.size()); ++axes)
    places.push_back(artefact_place(truth, cell, axes, options, random));
  for (const calib::Target& target : cell.targets) {
    const Eigen::Isometry3d& place = places[static_cast<std::size_t>(target.carried_by)];
    truth.centre_m.push_back(place * target.centre_m);
    truth.carried_by.push_back(target.carried_by);
    const double draw = bounded_normal(random);
    truth.radius_m.push_back(target.kind == calib::TargetKind::kSphere
                                 ? (target.diameter_m + target.diameter_sigma_m * draw) / 2.0 +
                                       cell.tool.tip_radius_m
                                 : 0.0);
    if (target.kind == calib::TargetKind::kPlane && target.extent_m > 0.0)
      truth.faces.push_back({truth.centre_m.back(), place.linear() * target.normal,
                             target.extent_m / 2.0, cell.tool.tip_radius_m});
  }
  if (!options.tool_shift_m.isZero()) {
    calib::Tool tool = truth.arm.tool();
    tool.tcp.translation() += options.tool_shift_m;
    truth.arm = calib::ArmModel(truth.arm.robot(), tool);
  }
  truth.held = options.held;
  return truth;
}

EarlyContact::EarlyContact(const ContactScatter& scatter, std::uint64_t seed)
    : scatter_(scatter), random_(seed + kOwnDraws) {
  noise_m_ = noise();
}

double EarlyContact::noise() {
  if (!(scatter_.noise_m > 0.0)) return 0.0;
  return scatter_.noise_m * std::clamp(random_.normal(), -kLargestSigma, kLargestSigma);
}

void EarlyContact::begin_visit() {
  chip_m_ = 0.0;
  if (!(scatter_.bad_share > 0.0) || random_.uniform() >= scatter_.bad_share) return;
  chip_m_ = random_.uniform(kLeastChipM, kMostChipM);
  falls_off_ = random_.uniform() < 0.5;
}

void EarlyContact::update(double gap_m, bool closed) {
  touched_ = touched_ || closed;
  if (touched_ && !closed && gap_m - chip_m_ > kOpenM) {
    touched_ = false;
    noise_m_ = noise();
    if (falls_off_) chip_m_ = 0.0;
  }
  const bool near = gap_m < kAwayM;
  if (near_ && !near) begin_visit();  // for the next visit
  near_ = near;
}

calib::Robot measured_robot(const Truth& truth) {
  calib::Robot robot = truth.arm.robot();
  const auto& parameters = truth.arm.parameters();
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    const calib::ParameterKey& key = parameters[i];
    if (key.joint < 0) continue;
    calib::Joint& joint = robot.joints[static_cast<std::size_t>(key.joint)];
    const double error = truth.errors[static_cast<Eigen::Index>(i)];
    using enum calib::ParameterKind;
    if (key.kind == kTheta) joint.offset_rad += error;
    if (key.kind == kD) joint.d_m += error;
    if (key.kind == kA) joint.a_m += error;
    if (key.kind == kAlpha) joint.alpha_rad += error;
    if (key.kind == kBeta) joint.beta_rad += error;
  }
  return robot;
}

calib::JointVector facing(const calib::Robot& robot, calib::JointVector posture,
                          const Eigen::Vector3d& place_m) {
  const std::size_t arm = robot.first_turning();
  Eigen::Vector3d off = place_m;
  if (arm > 0) {
    const calib::Joint& track = robot.joints[0];
    const Eigen::Vector3d along = robot.base_fixed.linear() * track.guide->along;
    off -= robot.base_fixed.translation();
    posture[0] = std::clamp(along.dot(off), track.min_rad, track.max_rad);
    off -= posture[0] * along;
  }
  const calib::Joint& first = robot.joints[arm];
  posture[arm] =
      std::clamp(first.sign * std::atan2(off.y(), off.x()), first.min_rad, first.max_rad);
  return posture;
}

}  // namespace cellcal::sim
