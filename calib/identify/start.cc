#include "calib/identify/start.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

namespace cellcal::calib {

namespace {

constexpr int kIterations = 50;
constexpr double kNominalOffM = 2e-3;  // what a nominal arm is wrong by
constexpr double kSettledM = 1e-8;  // where an estimate starts from
/// Smallest over largest singular value of the centred points: below it they lie in a plane.
constexpr double kFlat = 0.02;
/// Of points on a plane the thickness is what the nominal arm is wrong by; more of the width than
/// this, and they are on no plane.
constexpr double kThick = 0.5;
/// Readings are good to a hair: second over first singular value, below it they are in a line.
constexpr double kThin = 1e-3;

Eigen::Vector3d mean_of(const std::vector<Eigen::Vector3d>& points) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const auto& p : points) mean += p / static_cast<double>(points.size());
  return mean;
}

Eigen::JacobiSVD<Eigen::MatrixXd> spread_of(const std::vector<Eigen::Vector3d>& points,
                                            const Eigen::Vector3d& mean) {
  Eigen::MatrixXd centred(3, static_cast<Eigen::Index>(points.size()));
  for (Eigen::Index i = 0; i < centred.cols(); ++i)
    centred.col(i) = points[static_cast<std::size_t>(i)] - mean;
  return Eigen::JacobiSVD<Eigen::MatrixXd>(centred, Eigen::ComputeFullU);
}

/// Gauss-Newton steps to where the points' distances are the radii, each weighed by how far it is
/// off, and `prior` [1/m^2] pulls towards `place_m`. From `centre_m`, which it returns where they
/// lead nowhere.
template <class Weight>
Eigen::Vector3d settle(const std::vector<Eigen::Vector3d>& points_m,
                       const std::vector<double>& radius_m, Eigen::Vector3d centre_m,
                       const Weight& weight, double prior, const Eigen::Vector3d& place_m) {
  Eigen::Vector3d centre = centre_m;
  for (int k = 0; k < kIterations; ++k) {
    Eigen::Matrix3d information = prior * Eigen::Matrix3d::Identity();
    Eigen::Vector3d right = prior * (place_m - centre);
    for (std::size_t i = 0; i < points_m.size(); ++i) {
      const Eigen::Vector3d d = points_m[i] - centre;
      const double length = std::max(d.norm(), 1e-12), off = length - radius_m[i];
      const Eigen::Vector3d j = -d / length, weighted = weight(off) * j;
      information += weighted * j.transpose();
      right -= off * weighted;
    }
    const Eigen::Vector3d step = information.ldlt().solve(right);
    if (!step.allFinite()) break;
    centre += step;
    if (step.norm() < kSettledM) break;
  }
  return centre.allFinite() ? centre : centre_m;
}

}  // namespace

SphereFit fit_centre(const std::vector<Eigen::Vector3d>& points_m,
                     const std::vector<double>& radius_m, const Eigen::Vector3d* guess) {
  SphereFit fit;
  const auto n = static_cast<Eigen::Index>(points_m.size());
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const auto& p : points_m) mean += p / static_cast<double>(n);
  fit.centre_m = guess != nullptr ? *guess : mean;
  if (n < 4) return fit;

  // |p - c|^2 = r^2, centred on the mean: 2 p.c + (r0^2 - |c|^2) = |p|^2 + r0^2 - r^2
  Eigen::MatrixX4d a(n, 4);
  Eigen::VectorXd b(n);
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (Eigen::Index i = 0; i < n; ++i) {
    const Eigen::Vector3d p = points_m[static_cast<std::size_t>(i)] - mean;
    scatter += p * p.transpose();
    a.row(i) << 2.0 * p.transpose(), 1.0;
    const double r = radius_m[static_cast<std::size_t>(i)], r0 = radius_m.front();
    b[i] = p.squaredNorm() + r0 * r0 - r * r;
  }
  const Eigen::Vector3d square =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(scatter, Eigen::EigenvaluesOnly).eigenvalues();
  if (!(square[0] >= kFlat * kFlat * square[2])) return fit;
  fit.determined = true;
  // Gross errors pull no more than by their side.
  const auto weight = [](double off_m) { return 1.0 / std::hypot(1.0, off_m / kNominalOffM); };
  fit.centre_m = settle(points_m, radius_m, mean + a.colPivHouseholderQr().solve(b).head<3>(),
                        weight, 0.0, mean);
  return fit;
}

Eigen::Vector3d fit_centre_near(const std::vector<Eigen::Vector3d>& points_m,
                                const std::vector<double>& radius_m, double point_sigma_m,
                                const Eigen::Vector3d& place_m, double place_sigma_m) {
  const double prior = place_sigma_m > 0.0 ? 1.0 / (place_sigma_m * place_sigma_m) : 1e-12;
  const double weight = 1.0 / (point_sigma_m * point_sigma_m);
  return settle(points_m, radius_m, place_m, [&](double) { return weight; }, prior, place_m);
}

PlaneFit fit_plane(const std::vector<Eigen::Vector3d>& points_m) {
  PlaneFit fit;
  if (points_m.empty()) return fit;
  fit.middle_m = mean_of(points_m);
  if (points_m.size() < 3) return fit;
  const auto svd = spread_of(points_m, fit.middle_m);
  const Eigen::VectorXd s = svd.singularValues();
  fit.normal = svd.matrixU().col(2);
  fit.determined = s[1] > kFlat * s[0] && s[2] < kThick * s[1];
  return fit;
}

FrameFit fit_frame(const std::vector<Eigen::Vector3d>& readings_m,
                   const std::vector<Eigen::Vector3d>& points_m) {
  FrameFit fit;
  if (readings_m.empty()) return fit;
  fit.middle_m = mean_of(readings_m);
  fit.frame.translation() = mean_of(points_m) - fit.middle_m;
  if (readings_m.size() < 3) return fit;
  const Eigen::VectorXd s = spread_of(readings_m, fit.middle_m).singularValues();
  fit.determined = s[1] > kThin * s[0];
  if (!fit.determined) return fit;
  Eigen::Matrix3Xd from(3, static_cast<Eigen::Index>(readings_m.size())), to(from);
  for (Eigen::Index i = 0; i < from.cols(); ++i) {
    from.col(i) = readings_m[static_cast<std::size_t>(i)];
    to.col(i) = points_m[static_cast<std::size_t>(i)];
  }
  const Eigen::Matrix4d motion = Eigen::umeyama(from, to, false);
  if (motion.allFinite()) fit.frame.matrix() = motion;
  return fit;
}

}  // namespace cellcal::calib
