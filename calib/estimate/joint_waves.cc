#include <algorithm>
#include <cmath>

#include "calib/estimate/joint_functions.h"
#include "calib/estimate/level_family.h"
#include "calib/model/linear.h"
#include "calib/model/long_work.h"
#include "calib/model/product.h"

namespace cellcal::calib {

std::vector<RowsOfJoint> rows_by_joint(const Problem& problem, const Eigen::VectorXd& u,
                                       const MeanRows& mean) {
  const Robot& robot = problem.arm().robot();
  const Linearisation& linear = mean.linear;
  std::vector<RowsOfJoint> all;
  for (std::size_t j = robot.first_turning(); j < robot.joints.size(); ++j)
    all.push_back(
        {j, Eigen::VectorXd::Zero(linear.length_row), Eigen::VectorXd::Zero(linear.length_row)});
  const Eigen::VectorXd x = problem.to_si(u);
  const Problem::At at = problem.at(x.data());
  ArmChain chain;
  for (const auto& [touch, row] : linear.touch_row) {
    problem.arm().walk(problem.pose(touch), at.arm, chain);
    Eigen::Matrix3d along = Eigen::Matrix3d::Identity();
    const int count = problem.place_rows(touch);
    const double sigma_m = problem.sigma_m(touch) / std::sqrt(mean.times[touch]);
    if (count == 1) {
      double residual_m = 0.0;
      Eigen::Vector3d direction;
      problem.residual_m(touch, at, &residual_m, nullptr, nullptr, &direction);
      along.col(0) = direction;
    }
    for (RowsOfJoint& one : all) {
      const ArmChain::Link& link = chain.link[one.joint];
      const Eigen::Vector3d moves = link.z.cross(chain.tip - link.z_origin);
      one.lever.segment(row, count) = along.leftCols(count).transpose() * moves / sigma_m;
      one.angle_rad.segment(row, problem.rows(touch))
          .setConstant(problem.touches()[touch].joint_rad[one.joint]);
    }
  }
  return all;
}

Eigen::MatrixXd waves_of(const RowsOfJoint& rows, int lowest, int highest) {
  const Eigen::ArrayXd lever = rows.lever.array(), angle = rows.angle_rad.array();
  const Eigen::ArrayXd once_c = angle.cos(), once_s = angle.sin();
  Eigen::MatrixXd waves(lever.size(), 2 * (highest - lowest + 1));
  Eigen::ArrayXd c = lever * (lowest * angle).cos(), s = lever * (lowest * angle).sin();
  for (Eigen::Index k = 0; k < waves.cols(); k += 2) {
    waves.col(k) = c;
    waves.col(k + 1) = s;
    const Eigen::ArrayXd next = c * once_c - s * once_s;
    s = s * once_c + c * once_s;
    c = next;
  }
  return waves;
}

namespace {

/// Required gain of log likelihood beyond the logarithm of the number of candidates.
constexpr double kGainOfWave = 3.0;
/// Most waves of all joints in one search.
constexpr int kMostWaves = 18;
/// Candidates whose gain is computed exactly, the likeliest by their amplitudes alone.
constexpr std::size_t kExamined = 8;
/// Determinant of the information of a wave, relative to that without other unknowns, below which
/// those cannot be told from it.
constexpr double kSeparate = 1e-4;

struct Wave {
  std::size_t joint = 0;
  int order = 0;
  double likely = 0.0;  ///< square of the amplitude in sigmas, other unknowns known
  double gain = 0.0;    ///< of log likelihood
  double sigma_rad = 0.0;
};

/// Whitened residuals of the touches and the effect of waves on them. Covariance of the rows with the
/// unknowns marginalised: scatter times 1 - known known'.
class Remainder {
 public:
  Remainder(const Problem& problem, const Estimate& e, const MeanRows& mean);

  /// Number of candidates.
  double candidates() const {
    return static_cast<double>(joints_.size() * (kHighestWave - kLowestOrder + 1));
  }
  /// That of the largest gain.
  Wave best() const;
  /// Counts the wave among the unknowns.
  void add(const Wave& wave);

 private:
  using Columns = Eigen::Matrix<double, Eigen::Dynamic, 2>;
  /// Amplitudes' gradient and information, of unit scatter.
  struct Score {
    Columns by_wave;
    Eigen::Vector2d gradient;
    Eigen::Matrix2d information;
    bool separate = false;
  };

  Score score(const Wave& wave) const;
  void judge(Wave& wave) const;
  double scatter() const { return residual_.squaredNorm() / std::max(1.0, degrees_); }

  std::vector<RowsOfJoint> joints_;
  Eigen::VectorXd residual_;
  Eigen::MatrixXd known_;
  double degrees_ = 0.0;
};

Remainder::Remainder(const Problem& problem, const Estimate& e, const MeanRows& mean)
    : joints_(rows_by_joint(problem, e.u, mean)) {
  const Linearisation& at = mean.linear;
  const Eigen::Index rows = at.length_row;
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(problem.size(), problem.size());
  add_square(1.0, at.jacobian.transpose(), information);
  Eigen::VectorXd gradient = at.jacobian.transpose() * at.residual;
  for (int i = 0; i < problem.size(); ++i) {
    const Unknown& unknown = problem.unknowns()[static_cast<std::size_t>(i)];
    const double precision = std::max(kFlatPrecision, std::pow(unknown.prior_weight, 2));
    information(i, i) += precision;
    gradient[i] += precision * (e.u[i] - unknown.prior_mean_u);
  }
  const Cholesky factor(std::move(information));
  if (!factor.positive()) {
    joints_.clear();
    return;
  }
  const auto by_unknowns = at.jacobian.topRows(rows);
  known_ = factor.whitened(Eigen::MatrixXd(by_unknowns.transpose())).transpose();
  residual_ = at.residual.head(rows) - by_unknowns * factor.solve(gradient);
  degrees_ = static_cast<double>(rows) - known_.squaredNorm();
}

Remainder::Score Remainder::score(const Wave& wave) const {
  Score s;
  s.by_wave = waves_of(*std::ranges::find(joints_, wave.joint, &RowsOfJoint::joint), wave.order,
                       wave.order);
  s.gradient = s.by_wave.transpose() * residual_;
  const Eigen::Matrix<double, Eigen::Dynamic, 2> shared = known_.transpose() * s.by_wave;
  const Eigen::Matrix2d alone = s.by_wave.transpose() * s.by_wave;
  s.information = alone - shared.transpose() * shared;
  s.separate =
      s.information.trace() > 0.0 && s.information.determinant() > kSeparate * alone.determinant();
  return s;
}

/// (27e) at the likeliest size, were both amplitudes seen equally well.
void Remainder::judge(Wave& wave) const {
  const Score s = score(wave);
  if (!s.separate) return;
  const Eigen::Matrix2d information = s.information / scatter();
  const Eigen::Vector2d gradient = s.gradient / scatter();
  const double square = gradient.dot(information.inverse() * gradient);
  const double variance = (square / 2.0 - 1.0) / (information.trace() / 2.0);
  if (!(variance > 0.0)) return;
  const Eigen::Matrix2d with = information + Eigen::Matrix2d::Identity() / variance;
  wave.sigma_rad = std::sqrt(variance);
  wave.gain = 0.5 * gradient.dot(with.inverse() * gradient) -
              0.5 * std::log(with.determinant() * variance * variance);
}

Wave Remainder::best() const {
  std::vector<Wave> waves;
  for (const RowsOfJoint& rows : joints_) {
    const double square = rows.lever.squaredNorm();
    if (!(square > 0.0)) continue;
    const Eigen::VectorXd gradient =
        waves_of(rows, kLowestOrder, kHighestWave).transpose() * residual_;
    for (Eigen::Index k = 0; k < gradient.size(); k += 2)
      waves.push_back({rows.joint, kLowestOrder + static_cast<int>(k / 2),
                       gradient.segment<2>(k).squaredNorm() / square});
  }
  const std::size_t count = std::min(kExamined, waves.size());
  std::ranges::partial_sort(waves, waves.begin() + static_cast<std::ptrdiff_t>(count),
                            std::greater{}, &Wave::likely);
  waves.resize(count);
  for (Wave& wave : waves) judge(wave);
  const auto most = std::ranges::max_element(waves, {}, &Wave::gain);
  return most == waves.end() ? Wave{} : *most;
}

void Remainder::add(const Wave& wave) {
  const Score s = score(wave);
  const Eigen::Matrix2d prior =
      Eigen::Matrix2d::Identity() * (scatter() / (wave.sigma_rad * wave.sigma_rad));
  const Eigen::Matrix2d covariance = (s.information + prior).inverse();
  const Columns by = s.by_wave - known_ * (known_.transpose() * s.by_wave);
  residual_ -= by * (covariance * s.gradient);
  const Eigen::Matrix2d lower = covariance.llt().matrixL();
  known_.conservativeResize(Eigen::NoChange, known_.cols() + 2);
  known_.rightCols<2>() = by * lower;
  degrees_ -= (covariance * s.information).trace();
}

void add_wave(const Wave& wave, std::vector<JointWave>& waves) {
  const auto at = std::ranges::lower_bound(waves, wave.order, {}, &JointWave::order);
  if (at != waves.end() && at->order == wave.order)
    at->sigma_rad = std::hypot(at->sigma_rad, wave.sigma_rad);
  else
    waves.insert(at, {wave.order, wave.sigma_rad});
}

}  // namespace

FoundWaves find_waves(const Problem& problem, const Estimate& e) {
  FoundWaves found{problem.arm().robot()};
  Remainder left(problem, e, mean_rows(problem, e.posterior.linear));
  const double required = std::log(left.candidates()) + kGainOfWave;
  while (found.count < kMostWaves) {
    poll_cancelled();
    const Wave wave = left.best();
    if (!(wave.gain > required)) break;
    left.add(wave);
    add_wave(wave, found.robot.joints[wave.joint].waves);
    ++found.count;
    found.required_gain += required;
  }
  return found;
}

}  // namespace cellcal::calib
