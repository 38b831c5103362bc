#include "tests/experiments/true_arm.h"

#include <array>
#include <cmath>
#include <numbers>
#include <numeric>

namespace cellcal::experiments {

namespace {

constexpr double kRadPerArcsec = std::numbers::pi / 180.0 / 3600.0;

/// One of four kinds with equal odds: no error; waves of 5 to 35 periods per turn; such a wave with flat halves, as
/// from tooth meshing; one that decays from a damaged spot over a radian. `rms` over the turn.
std::function<double(double, double)> make_mixed_gear(double rms, calib::Random& random) {
  constexpr double kFlat = 4.0, kRmsOfFlat = 0.88, kWaves = 3.0, kDecayRad = 1.0;
  constexpr double kTurn = 2.0 * std::numbers::pi;
  const double kind = random.uniform(0.0, 4.0), spot = random.uniform(-2.0, 2.0);
  std::array<double, 3> order, phase;
  for (double& one : order) one = random.uniform(5.0, 35.0);
  for (double& one : phase) one = random.uniform(0.0, kTurn);
  if (kind < 1.0) return [](double, double) { return 0.0; };
  if (kind < 2.0)
    return [=](double q, double) {
      double sum = 0.0;
      for (std::size_t k = 0; k < order.size(); ++k) sum += std::sin(order[k] * q + phase[k]);
      return rms * std::sqrt(2.0 / kWaves) * sum;
    };
  if (kind < 3.0)
    return [=](double q, double) {
      return rms / kRmsOfFlat * std::tanh(kFlat * std::sin(order[0] * q + phase[0]));
    };
  const double highest = rms * std::sqrt(2.0 * kTurn / kDecayRad);
  return [=](double q, double) {
    const double away = std::abs(std::remainder(q - spot, kTurn));
    return highest * std::exp(-away / kDecayRad) * std::sin(order[0] * q + phase[0]);
  };
}

struct Gear {
  std::function<double(double q, double torque)> error;
  std::vector<GearWave> waves;
};

Gear make_gear(const TruthSettings& s, calib::Random& random) {
  const double rms = s.gear_arcsec * kRadPerArcsec;
  if (s.gears == Gears::kNone || rms <= 0.0) return {[](double, double) { return 0.0; }, {}};
  if (s.gears == Gears::kMixed) return {make_mixed_gear(rms, random), {}};
  std::vector<GearWave> waves;
  double backlash = 0.0;
  if (s.gears == Gears::kWaves) {
    // Strain-wave gears: six waves of 5 to 35 periods per turn, and slow ones of 10 arcsec.
    constexpr double kSlowRad = 10.0 * kRadPerArcsec;
    for (const double order : {1.0, 2.0})
      waves.push_back({order,
                       kSlowRad * std::hypot(random.normal(), random.normal()) / std::sqrt(2.0),
                       random.uniform(0.0, 2.0 * std::numbers::pi)});
    constexpr int kFast = 6;
    for (int k = 0; k < kFast; ++k)
      waves.push_back({random.uniform(5.0, 35.0),
                       rms * std::hypot(random.normal(), random.normal()) / std::sqrt(1.0 * kFast),
                       random.uniform(0.0, 2.0 * std::numbers::pi)});
  } else if (s.gears == Gears::kHarmonics) {
    // Two orders of equal variance: amplitude^2 / 2 each, rms^2 in all.
    for (const double order : {1.0, 2.0})
      waves.push_back({order, rms * std::hypot(random.normal(), random.normal()) / std::sqrt(2.0),
                       random.uniform(0.0, 2.0 * std::numbers::pi)});
  } else {
    double sum = 0.0;
    for (const double order : {1.0, 2.0, 3.0, 4.0, 5.0}) {
      waves.push_back(
          {order, (0.5 + random.uniform()) / order, random.uniform(0.0, 2.0 * std::numbers::pi)});
      sum += waves.back().amplitude * waves.back().amplitude / 2.0;
    }
    // The wave generator's or pinion's order: too fast to be resolved from touch to touch.
    waves.push_back({random.uniform(60.0, 160.0), 0.5, random.uniform(0.0, 6.28)});
    sum += 0.125;
    const double scale = 0.9 * rms / std::sqrt(sum);
    for (GearWave& wave : waves) wave.amplitude *= scale;
    backlash = 0.4 * rms;
  }
  return {[waves, backlash](double q, double torque) {
            double error = backlash * std::tanh(torque / 5.0);  // 5 N m close the play
            for (const GearWave& wave : waves)
              error += wave.amplitude * std::sin(wave.order * q + wave.phase);
            return error;
          },
          waves};
}

/// Torque on joint 2: a spring from a point behind its axis to one on the link arm, without torque
/// if the link arm is upright (q = -90 deg).
std::function<double(double)> make_spring(const TruthSettings& s, calib::Random& random) {
  if (!(s.spring_nm > 0.0)) return {};
  const double behind_m = random.uniform(0.5, 0.8), along_m = random.uniform(0.2, 0.35);
  const double rate = random.uniform(0.5, 2.0);  // growth of the force with the length, 1/m
  const double aside = 0.05 * random.normal();   // of the point, rad
  const auto torque = [=](double lean) {
    const double length = std::sqrt(behind_m * behind_m + along_m * along_m +
                                    2.0 * behind_m * along_m * std::cos(lean));
    const double force = 1.0 + rate * (behind_m + along_m - length);
    return force * behind_m * along_m * std::sin(lean) / length;
  };
  constexpr double kUpright = -std::numbers::pi / 2.0, kLean = std::numbers::pi / 3.0;
  const double scale = s.spring_nm / torque(kLean);
  return [=](double q) { return -scale * torque(q - kUpright + aside); };
}

/// Softer at low load, symmetric in the torque.
std::function<double(double)> make_soft(const TruthSettings& s, calib::Random& random) {
  const double size = s.soft_rad * std::abs(random.normal());
  const double stiff_nm = random.uniform(500.0, 2000.0);
  return [=](double torque) {
    return std::copysign(size * (1.0 - std::exp(-std::abs(torque) / stiff_nm)), torque);
  };
}

double factor_of(const std::vector<double>& factors, std::size_t joint) {
  return joint < factors.size() ? factors[joint] : 1.0;
}

}  // namespace

TrueArm::TrueArm(const calib::Cell& cell, const TruthSettings& s, calib::Random& random)
    : tcp_(cell.tool.tcp.translation()),
      tool_com_(cell.tool.com_m),
      gravity_(cell.robot.gravity_m_s2),
      tool_mass_(cell.tool.mass_kg),
      tool_length_(cell.tool.length_m),
      c_t_(std::abs(random.normal()) * 0.0015),
      growth_(s.growth) {
  for (double& component : tcp_) component += s.tip_offset_m * random.uniform(-1.0, 1.0);
  for (const calib::Joint& j : cell.robot.joints) {
    if (j.is_prismatic()) continue;
    Joint t{static_cast<double>(j.sign),
            j.offset_rad,
            j.d_m,
            j.a_m,
            j.alpha_rad,
            j.beta_rad,
            0.0,
            j.mass_kg,
            j.com_m,
            {},
            {}};
    Gear gear = make_gear(s, random);
    t.gear = std::move(gear.error);
    waves_.push_back(std::move(gear.waves));
    const double length_sigma = s.length_sigma_m * factor_of(s.length_factor, joints_.size());
    const double angle_sigma = s.angle_sigma_rad * factor_of(s.angle_factor, joints_.size());
    for (const calib::JointError e : j.errors) {
      const double n = random.normal();
      switch (e) {
        case calib::JointError::kTheta: t.offset += angle_sigma * n; break;
        case calib::JointError::kD: t.d += length_sigma * n; break;
        case calib::JointError::kA: t.a += length_sigma * n; break;
        case calib::JointError::kAlpha: t.alpha += angle_sigma * n; break;
        case calib::JointError::kBeta: t.beta += angle_sigma * n; break;
      }
    }
    const std::size_t index = joints_.size();
    if (index == 1 || index == 2 || index == 4) {
      t.stiffness = s.compliance_rad_per_nm * std::abs(random.normal());
      if (s.play_arcsec > 0.0)
        t.gear = [gear = t.gear, play = s.play_arcsec * kRadPerArcsec](double q, double torque) {
          constexpr double kGivesNm = 100.0;
          return gear(q, torque) + play * std::tanh(torque / kGivesNm);
        };
    }
    if (index == 1) t.spring_nm = make_spring(s, random);
    if (s.soft_rad > 0.0 && (index == 1 || index == 2 || index == 4))
      t.gear = [gear = t.gear, soft = make_soft(s, random)](double q, double torque) {
        return gear(q, torque) + soft(torque);
      };
    joints_.push_back(std::move(t));
  }
  if (cell.robot.first_turning() > 0) track_.emplace(cell.robot.joints[0], s.track, random);
  if (!(s.field_m > 0.0)) return;
  // Many waves of random direction and length: nearly Gaussian, correlation exp(-d^2 / 2 reach^2).
  constexpr int kWaves = 100;
  for (int k = 0; k < kWaves; ++k) {
    Wave wave;
    for (double& component : wave.along)
      component = s.field_m * std::sqrt(2.0 / kWaves) * random.normal();
    for (std::size_t i = 0; i < joints_.size(); ++i)
      wave.by_axis.push_back(random.normal() / s.field_reach_rad / (i < 3 ? 1.0 : 3.0));
    wave.phase = random.uniform(0.0, 2.0 * std::numbers::pi);
    field_.push_back(std::move(wave));
  }
}

Eigen::Matrix4d TrueArm::link(std::size_t i, double theta, double warm) const {
  const Joint& j = joints_[i];
  const double grown = 1.0 + grown_ + growth_ * warm;
  const double ct = std::cos(theta), st = std::sin(theta);
  const double ca = std::cos(j.alpha), sa = std::sin(j.alpha);
  const double cb = std::cos(j.beta), sb = std::sin(j.beta);
  Eigen::Matrix4d m;  // Hayati's matrix, written out
  m << ct * cb - st * sa * sb, -st * ca, ct * sb + st * sa * cb, j.a * grown * ct,
      st * cb + ct * sa * sb, ct * ca, st * sb - ct * sa * cb, j.a * grown * st, -ca * sb, sa,
      ca * cb, j.d * grown, 0, 0, 0, 1;
  return m;
}

Eigen::Vector3d TrueArm::tip(const std::vector<double>& q, double warm) const {
  if (!track_) return tip_from_foot(q, gravity_, warm);
  const Eigen::Isometry3d foot = track_->carriage(q[0]);
  return foot * tip_from_foot({q.begin() + 1, q.end()}, foot.linear().transpose() * gravity_, warm);
}

Eigen::Vector3d TrueArm::tip_from_foot(const std::vector<double>& q, const Eigen::Vector3d& gravity,
                                       double warm) const {
  std::vector<double> theta(q.size());
  for (std::size_t i = 0; i < q.size(); ++i) theta[i] = joints_[i].sign * q[i] + joints_[i].offset;
  // Twice: the second time with the torques of the deflected arm.
  std::vector<double> given = theta;
  Eigen::Matrix4d flange;
  for (int pass = 0; pass < 2; ++pass) {
    std::vector<Eigen::Matrix4d> frame{Eigen::Matrix4d::Identity()};
    for (std::size_t i = 0; i < q.size(); ++i)
      frame.push_back(frame.back() * link(i, given[i], warm));
    flange = frame.back();
    for (std::size_t i = 0; i < q.size(); ++i) {
      const Eigen::Vector3d axis = frame[i].block<3, 1>(0, 2), origin = frame[i].block<3, 1>(0, 3);
      double torque = 0.0;
      for (std::size_t k = i; k < q.size(); ++k) {
        const Eigen::Vector3d com = (frame[k + 1] * joints_[k].com.homogeneous()).head<3>();
        torque += axis.dot((com - origin).cross(joints_[k].mass * gravity));
      }
      const Eigen::Vector3d tool = (flange * tool_com_.homogeneous()).head<3>();
      torque += axis.dot((tool - origin).cross(tool_mass_ * gravity));
      if (joints_[i].spring_nm) torque += joints_[i].spring_nm(q[i]);
      given[i] = theta[i] + joints_[i].stiffness * torque + joints_[i].gear(q[i], torque);
    }
  }
  Eigen::Matrix4d bent = Eigen::Matrix4d::Identity();
  for (std::size_t i = 0; i < q.size(); ++i) bent *= link(i, given[i], warm);
  const Eigen::Vector3d z = bent.block<3, 1>(0, 2);
  const double force_factor = c_t_ * tool_mass_ * std::pow(tool_length_, 3) / 3.0;
  Eigen::Vector3d tip =
      (bent * tcp_.homogeneous()).head<3>() + force_factor * (gravity - gravity.dot(z) * z);
  for (const Wave& wave : field_)
    tip += wave.along *
           std::cos(std::inner_product(q.begin(), q.end(), wave.by_axis.begin(), wave.phase));
  return tip;
}

}  // namespace cellcal::experiments
