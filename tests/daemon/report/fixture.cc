#include "tests/daemon/report/fixture.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <random>
#include <string>
#include <vector>

namespace cellcal::daemon::report::testing {
namespace {

using calib::Calibration;
using calib::DecidedBy;
using calib::ParameterKey;
using calib::ParameterKind;
using calib::ParameterResult;

constexpr double kDeg = std::numbers::pi / 180.0;
constexpr double kArcsec = kDeg / 3600.0;
constexpr double kTouchSigma = 3e-5;
constexpr double kSphereDiameter = 0.0614;

// The standard's distributions differ between libraries; these sums do not.
class Noise {
 public:
  explicit Noise(unsigned seed) : engine_(seed) {}
  double uniform(double from, double to) {
    return from +
           (to - from) * static_cast<double>(engine_()) / static_cast<double>(std::mt19937::max());
  }
  double normal() {
    double sum = -6.0;
    for (int i = 0; i < 12; ++i) sum += uniform(0.0, 1.0);
    return sum;
  }

 private:
  std::mt19937 engine_;
};

calib::Robot make_robot(std::size_t joints) {
  struct Row {
    double d_mm, a_mm, alpha_deg;
    bool parallel;
  };
  constexpr std::array<Row, 7> kRows{{{400, 180, -90, false},
                                      {0, 600, 0, true},
                                      {0, 40, -90, false},
                                      {620, 0, 90, false},
                                      {0, 0, 90, false},
                                      {80, 0, 0, false},
                                      {126, 0, 0, false}}};
  calib::Robot robot;
  robot.name = "KUKA KR 5 R1400";
  robot.source = "Appl. Sci. 2024, 14, 9824, Table 1";
  for (std::size_t i = 0; i < joints; ++i) {
    const Row& row = kRows[i % kRows.size()];
    calib::Joint joint;
    joint.name = fmt::format("A{}", i + 1);
    joint.d_m = row.d_mm * 1e-3;
    joint.a_m = row.a_mm * 1e-3;
    joint.alpha_rad = row.alpha_deg * kDeg;
    joint.errors = {calib::JointError::kTheta, calib::JointError::kA, calib::JointError::kAlpha,
                    row.parallel ? calib::JointError::kBeta : calib::JointError::kD};
    robot.joints.push_back(joint);
  }
  return robot;
}

void add(Calibration& result, const ParameterKey& key, const std::string& unit, double to_unit,
         double nominal, double correction, double sigma, DecidedBy decided_by) {
  result.parameters.push_back({key, unit, to_unit, nominal, correction, sigma, decided_by});
}

void add_joint_parameters(Calibration& result, Noise& noise) {
  for (const calib::Joint& joint : result.cell.robot.joints) {
    const bool first = joint.name == "A1";
    const bool last = &joint == &result.cell.robot.joints.back();
    for (const calib::JointError error : joint.errors) {
      const bool length = error == calib::JointError::kD || error == calib::JointError::kA;
      const double tolerance = length ? 0.7e-3 : 0.6e-3;
      DecidedBy by = last ? DecidedBy::kPrior : DecidedBy::kData;
      double nominal = 0.0;
      auto kind = ParameterKind::kTheta;
      switch (error) {
        case calib::JointError::kTheta:
          if (first) by = DecidedBy::kFrame;
          break;
        case calib::JointError::kD:
          kind = ParameterKind::kD;
          nominal = joint.d_m;
          if (first) by = DecidedBy::kFrame;
          break;
        case calib::JointError::kA:
          kind = ParameterKind::kA;
          nominal = joint.a_m;
          break;
        case calib::JointError::kAlpha:
          kind = ParameterKind::kAlpha;
          nominal = joint.alpha_rad;
          break;
        case calib::JointError::kBeta: kind = ParameterKind::kBeta; break;
      }
      const double share = by == DecidedBy::kData ? noise.uniform(0.03, 0.2) : 0.9;
      const double correction = tolerance * noise.normal() * (by == DecidedBy::kData ? 1.0 : 0.15);
      const auto index = static_cast<std::size_t>(&joint - result.cell.robot.joints.data());
      add(result, joint_parameter(kind, index), length ? "mm" : "deg", length ? 1e3 : 1.0 / kDeg,
          nominal, correction, tolerance * share, by);
    }
  }
}

void add_targets(Calibration& result, const SessionShape& shape, Noise& noise) {
  constexpr std::array<std::array<double, 3>, 8> kPlaces{{{1.150, -0.420, 0.350},
                                                          {1.020, 0.510, 0.310},
                                                          {0.720, -0.080, 0.780},
                                                          {1.340, 0.060, 0.905},
                                                          {0.600, 0.900, 0.400},
                                                          {0.500, -0.950, 0.600},
                                                          {0.950, 0.350, 1.150},
                                                          {0.850, -0.600, 1.050}}};
  for (std::size_t i = 0; i < shape.spheres; ++i) {
    calib::Target target;
    target.id = fmt::format("S{}", i + 1);
    target.diameter_m = kSphereDiameter;
    target.diameter_sigma_m = 2e-6;
    target.centre_sigma_m = 0.02;
    result.cell.targets.push_back(target);
    const auto& place = kPlaces[i % kPlaces.size()];
    const Eigen::Vector3d centre(place[0] + 1e-3 * noise.normal(), place[1] + 1e-3 * noise.normal(),
                                 place[2] + 1e-3 * noise.normal());
    result.targets.push_back({target.id, centre, 0.5 * kSphereDiameter + 0.000213});
    for (int axis = 0; axis < 3; ++axis) {
      add(result, target_parameter(ParameterKind::kCentre, i, axis), "mm", 1e3,
          place[static_cast<std::size_t>(axis)],
          centre[axis] - place[static_cast<std::size_t>(axis)], axis == 2 ? 0.7e-3 : 0.65e-3,
          DecidedBy::kData);
    }
  }
  if (!shape.certified_lengths) return;
  for (std::size_t i = 1; i < shape.spheres; ++i) {
    const double found = (result.targets[i].centre_m - result.targets[0].centre_m).norm();
    result.cell.lengths.push_back(
        {result.targets[0].id, result.targets[i].id, found + 4e-6 * noise.normal(), 5e-6});
    const calib::CertifiedLength& length = result.cell.lengths.back();
    result.lengths.push_back({length.from, length.to, length.length_m, length.sigma_m,
                              length.length_m + 1e-5 * noise.normal(), 1.2e-5});
  }
}

Eigen::Vector3d touch_direction(Noise& noise) {
  const double z = noise.uniform(-0.45, 1.0);
  const double turn = noise.uniform(0.0, 2.0 * std::numbers::pi);
  const double flat = std::sqrt(1.0 - z * z);
  return {flat * std::cos(turn), flat * std::sin(turn), z};
}

calib::ResidualSummary summarise(const std::vector<double>& residuals) {
  calib::ResidualSummary summary;
  double squares = 0.0;
  for (const double r : residuals) {
    ++summary.count;
    summary.mean_m += std::abs(r);
    summary.max_m = std::max(summary.max_m, std::abs(r));
    squares += r * r;
  }
  if (summary.count > 0) {
    summary.mean_m /= summary.count;
    summary.rms_m = std::sqrt(squares / summary.count);
  }
  return summary;
}

void add_touches(ReportInput& input, const SessionShape& shape, Noise& noise) {
  Calibration& result = input.calibration;
  const std::size_t total = shape.spheres == 0 ? 0 : shape.fit + shape.check;
  std::vector<double> before, after, check_before, check_after;
  std::size_t outliers_left = shape.outliers;
  std::size_t checks_left = shape.check;
  for (std::size_t i = 0; i < total; ++i) {
    calib::Touch touch;
    for (std::size_t j = 0; j < shape.joints; ++j) {
      touch.joint_rad.push_back(noise.uniform(-2.0, 2.0));
    }
    touch.target = result.targets[i % shape.spheres].id;
    const bool check = checks_left > 0 && (i % 5 == 4 || total - i <= checks_left);
    if (check) --checks_left;
    touch.set = check ? calib::TouchSet::kCheck : calib::TouchSet::kFit;
    touch.time = fmt::format("2025-03-14T02:{:02}:{:02}Z", (10 + i / 4) % 60, 15 * i % 60);
    touch.readings = 2;
    touch.spread_m = std::abs(1e-5 * noise.normal());
    touch.speed_m_s = 0.0015;
    touch.line = static_cast<int>(i) + 2;

    calib::TouchResidual residual;
    residual.touch = i;
    residual.direction = touch_direction(noise);
    const double turn = static_cast<double>(i % shape.spheres) + residual.direction.x();
    residual.before_m = 1e-3 * (1.7 * std::sin(1.9 * turn) + 1.1 * noise.normal());
    residual.after_m = kTouchSigma * noise.normal();
    if (!check && outliers_left > 0 && i % 30 == 11) {
      --outliers_left;
      residual.outlier = true;
      residual.after_m = 0.00062 + 1e-4 * noise.normal();
      result.outliers.push_back(
          {i, residual.after_m, 0.1, calib::OutlierKind::kOffItsTarget, touch.target});
      result.outliers.back().sigmas = residual.after_m / kTouchSigma;
    }
    residual.whitened = residual.after_m / kTouchSigma;
    result.residuals.push_back(residual);
    input.touches.push_back(touch);
    if (residual.outlier) continue;
    (check ? check_before : before).push_back(residual.before_m);
    (check ? check_after : after).push_back(residual.after_m);
  }
  result.before = summarise(before);
  result.after = summarise(after);
  result.check_before = summarise(check_before);
  result.check = summarise(check_after);
}

// Independent except for one strong pair and one frame direction, as in identifications.
void add_covariance(Calibration& result) {
  const auto size = static_cast<Eigen::Index>(result.parameters.size());
  Eigen::VectorXd sigma(size);
  for (Eigen::Index i = 0; i < size; ++i) {
    sigma[i] = result.parameters[static_cast<std::size_t>(i)].sigma;
  }
  result.covariance = sigma.cwiseAbs2().asDiagonal();
  const auto index_of = [&result](const ParameterKey& key) {
    const ParameterResult* found = find(result, key);
    return static_cast<Eigen::Index>(found == nullptr ? result.parameters.size()
                                                      : found - result.parameters.data());
  };
  const Eigen::Index a = index_of(joint_parameter(ParameterKind::kTheta, 1));
  const Eigen::Index b = index_of(joint_parameter(ParameterKind::kTheta, 2));
  if (a < size && b < size) {
    result.covariance(a, b) = result.covariance(b, a) = -0.94 * sigma[a] * sigma[b];
  }
  result.frame_basis = Eigen::MatrixXd::Zero(size, 1);
  for (Eigen::Index i = 0; i < size; ++i) {
    const ParameterKey& key = result.parameters[static_cast<std::size_t>(i)].key;
    const bool height = key.kind == ParameterKind::kCentre && key.axis == 2;
    if (height || key == joint_parameter(ParameterKind::kD, 0)) result.frame_basis(i, 0) = 0.7e-3;
  }
  result.covariance += result.frame_basis * result.frame_basis.transpose();
}

// Two directions of the frame with their targets, and the last link's.
void add_unidentifiable(Calibration& result) {
  if (result.cell.robot.joints.empty()) return;
  const std::size_t last = result.cell.robot.joints.size() - 1;
  const auto centre = [](int axis) { return target_parameter(ParameterKind::kCentre, 0, axis); };
  calib::UnidentifiableDirection turn{calib::UnidentifiableKind::kZeroOfFirstJoint};
  turn.direction = {{joint_parameter(ParameterKind::kTheta, 0), 0.99}};
  calib::UnidentifiableDirection height{calib::UnidentifiableKind::kHeightOfBase};
  height.direction = {{joint_parameter(ParameterKind::kD, 0), 0.998}};
  if (!result.cell.targets.empty()) {
    turn.direction.insert(turn.direction.end(), {{centre(0), -0.04}, {centre(1), 0.09}});
    height.direction.push_back({centre(2), 0.06});
  }
  calib::UnidentifiableDirection behind{calib::UnidentifiableKind::kBehindLastJoint};
  behind.direction = {{joint_parameter(ParameterKind::kTheta, last), 0.55},
                      {joint_parameter(ParameterKind::kAlpha, last), -0.61},
                      {joint_parameter(ParameterKind::kD, last), 0.31},
                      {joint_parameter(ParameterKind::kA, last), -0.48}};
  for (const auto& [key, share] : behind.direction) behind.parameters.push_back(key);
  result.unidentifiable = {turn, height, behind};
}

}  // namespace

ReportInput made_up_session(const SessionShape& shape) {
  Noise noise(shape.seed);
  ReportInput input;
  Calibration& result = input.calibration;
  result.cell.robot = make_robot(shape.joints);
  result.cell.tool.tcp.translation() = Eigen::Vector3d(0.0599, 0.0505, 0.4103);
  result.cell.tool.mass_kg = 1.535;
  result.cell.tool.length_m = 0.4177;
  result.cell.tool.deflection_sigma = 0.003;
  result.cell.touch_sigma_m = kTouchSigma;
  result.cell.radius_offset_sigma_m = 3e-4;

  // The best is not the one used: the touches do not distinguish the first two.
  result.level = {false, 1.0, 5.0 * kArcsec};
  result.levels = {
      {{false, 1.0, 0.0}, -120.4}, {result.level, -120.7}, {{false, 0.0, 0.0}, -124.6}};
  result.level_reason = {calib::LevelChoice::kMeanByEvidence};

  add_joint_parameters(result, noise);
  add(result, tool_parameter(ParameterKind::kDeflection, 0), "1/(N m^2)", 1.0, 0.0, 0.00036,
      0.00004, DecidedBy::kData);
  add(result, tool_parameter(ParameterKind::kEffectiveRadius, 0), "mm", 1e3, 0.0, 0.000213, 8e-6,
      DecidedBy::kData);
  add_targets(result, shape, noise);
  add_touches(input, shape, noise);
  add_covariance(result);

  add_unidentifiable(result);
  result.predicted_near_targets_m = shape.certified_lengths ? 6.2e-5 : 9.4e-5;
  result.predicted_workspace_m = shape.certified_lengths ? 8.4e-5 : 6.1e-4;
  result.chi2_per_dof = 0.97;
  result.degrees_of_freedom = 61.0;
  result.observability = {.rows = 66,
                          .unknowns = 81,
                          .directions = 22,
                          .rank = 21,
                          .determined = 19,
                          .singular_values = {},
                          .o1 = 3.14159,
                          .o2 = 0.01,
                          .o3 = 0.5,
                          .o4 = 0.005,
                          .o5 = 0.2,
                          .condition = 100.0};
  result.touch_noise_m = 2.95e-5;
  result.verdict.judged = true;
  result.verdict.workspace = shape.certified_lengths;
  result.inputs = {
      {"cell", "cell.toml", "9f86d081884c7d659a2feaa0c55ad015a3bf4f1b2b0b822cd15d6c15b0f00a08"},
      {"touches", "touches.csv",
       "60303ae22b998861bce3b28f33eec1be758a213c86c93c076dbe9f558c11c752"}};
  input.session_id = "2025-03-14-0210";
  input.started = "2025-03-14T02:10:00Z";
  input.finished = "2025-03-14T02:38:45Z";
  input.cell_name = "Welding cell 7";
  input.software = "0.1.0 (abc1234)";
  input.notes = {"Robot warm: 30 min of production moves before the first touch",
                 "Air 21.4 to 21.9 \xC2\xB0"
                 "C"};
  return input;
}

}  // namespace cellcal::daemon::report::testing
