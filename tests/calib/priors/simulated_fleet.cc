#include "tests/calib/priors/simulated_fleet.h"

#include <fmt/format.h>

#include "calib/model/kinematics.h"
#include "calib/model/linear.h"
#include "tests/calib/simulate.h"

namespace cellcal::calib::testing {

namespace {

double factor_of(const Truth& truth, const ParameterKey& key) {
  const auto joint = static_cast<std::size_t>(key.joint);
  if (key.kind == ParameterKind::kD || key.kind == ParameterKind::kA)
    return joint < truth.length.size() ? truth.length[joint] : 1.0;
  if (is_geometric(key.kind)) return joint < truth.angle.size() ? truth.angle[joint] : 1.0;
  return is_transmission(key.kind) ? truth.gear : 1.0;
}

Eigen::Vector3d direction(Random& random) {
  const Eigen::Vector3d n(random.normal(), random.normal(), random.normal());
  return n.normalized();
}

}  // namespace

Robot drawn_robot() { return demo_cell().robot; }

Truth uneven() { return {{0.4, 0.6, 2.0, 1.5, 0.5, 1.0}, {0.5, 1.0, 2.0, 0.6, 1.4, 0.7}, 0.6}; }

Calibration calibration_of(const Robot& drawn, const Robot& stated, const Truth& truth, int touches,
                           Random& random) {
  constexpr int kSpheres = 4;
  constexpr double kPlaceSigmaM = 0.02, kNoiseM = 3e-5;
  Calibration c;
  c.cell = demo_cell();
  c.cell.robot = drawn;
  const ArmModel true_arm(at_level(c.cell, {}));
  c.cell.robot = stated;
  const ArmModel arm(at_level(c.cell, {}));
  const int n = arm.size(), all = n + 3 * kSpheres;
  Eigen::VectorXd sigma = Eigen::VectorXd::Constant(all, kPlaceSigmaM), real(all);
  for (int i = 0; i < n; ++i) {
    sigma[i] = arm.parameters()[i].sigma;
    real[i] =
        factor_of(truth, arm.parameters()[i]) * true_arm.parameters()[i].sigma * random.normal();
  }
  for (int i = n; i < all; ++i) real[i] = 1e-3 * random.normal();
  Eigen::MatrixXd information = sigma.cwiseAbs2().cwiseInverse().asDiagonal();
  Eigen::VectorXd pull = Eigen::VectorXd::Zero(all);
  Eigen::Matrix3Xd jacobian(3, n);
  const Eigen::VectorXd nominal = Eigen::VectorXd::Zero(n);
  for (int t = 0; t < touches; ++t) {
    JointVector q;
    for (const Joint& joint : drawn.joints)
      q.push_back(random.uniform(0.6 * joint.min_rad, 0.6 * joint.max_rad));
    arm.position(arm.prepare(q), nominal.data(), jacobian);
    const Eigen::Vector3d along = direction(random);
    Eigen::VectorXd row = Eigen::VectorXd::Zero(all);
    row.head(n) = jacobian.transpose() * along;
    row.segment<3>(n + 3 * (t % kSpheres)) = -along;
    const double reading = row.dot(real) + kNoiseM * random.normal();
    information += row * row.transpose() / (kNoiseM * kNoiseM);
    pull += row * reading / (kNoiseM * kNoiseM);
  }
  // In prior sigmas, of which the numbers are all of one size.
  const Cholesky factor(sigma.asDiagonal() * information * sigma.asDiagonal());
  const Eigen::VectorXd mean =
      sigma.cwiseProduct(factor.solve(Eigen::VectorXd(sigma.cwiseProduct(pull))));
  c.covariance = sigma.head(n).asDiagonal() * factor.inverse().topLeftCorner(n, n) *
                 sigma.head(n).asDiagonal();
  for (int i = 0; i < n; ++i) {
    const ArmParameter& p = arm.parameters()[i];
    c.parameters.push_back({p, p.unit, p.to_unit, 0.0, mean[i], std::sqrt(c.covariance(i, i))});
  }
  c.frame_basis = Eigen::MatrixXd::Zero(n, 0);
  for (const Target& target : c.cell.targets)
    c.targets.push_back({target.id, target.centre_m, target.diameter_m / 2.0});
  c.chi2_per_dof = 1.0;
  c.verdict.judged = c.verdict.workspace = true;
  return c;
}

std::vector<Calibration> fleet_of(int arms, const Truth& truth, int touches, unsigned seed) {
  Random random(seed);
  std::vector<Calibration> fleet;
  for (int k = 0; k < arms; ++k)
    fleet.push_back(calibration_of(drawn_robot(), drawn_robot(), truth, touches, random));
  return fleet;
}

std::vector<ArmEvidence> evidence_of_all(const std::vector<Calibration>& calibrations) {
  std::vector<ArmEvidence> all;
  for (std::size_t k = 0; k < calibrations.size(); ++k) {
    auto one = evidence_of(calibrations[k]);
    if (auto* evidence = std::get_if<ArmEvidence>(&one)) {
      evidence->name = fmt::format("arm {:03}.json", k);
      all.push_back(std::move(*evidence));
    }
  }
  return all;
}

Calibration times(Calibration c, double factor) {
  for (ParameterResult& p : c.parameters) p.correction *= factor;
  return c;
}

const Spread& spread(const Learned& learned, std::size_t joint, SpreadKind kind) {
  return learned.priors.joints.at(joint).of(kind).value();
}

}  // namespace cellcal::calib::testing
