#include "calib/estimate/start.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "calib/model/linear.h"

namespace cellcal::calib {

Eigen::Vector3d mean_of_points(const std::vector<Eigen::Vector3d>& points) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const auto& p : points) mean += p / static_cast<double>(points.size());
  return mean;
}

namespace {

constexpr int kIterations = 50;
constexpr double kDivergedStepM = 100.0;  // a step of this size diverges
constexpr double kSettledM = 1e-8;        // for a starting point of the estimate
/// Smallest over largest singular value of the centred points: below this they lie in a plane.
constexpr double kFlat = 0.02;
/// Above this they surround the centre (half a sphere: 0.5), and the solution is unique.
constexpr double kAround = 0.4;
/// Largest ratio of thickness to width of points on a plane; the thickness is due to errors of the
/// nominal arm.
constexpr double kThick = 0.5;
/// Second over first singular value of the readings, which are accurate: below this they lie on a
/// line.
constexpr double kThin = 1e-3;

PointSpread spread_about(const Eigen::Vector3d& mean, const std::vector<Eigen::Vector3d>& points) {
  Eigen::MatrixXd centred(3, static_cast<Eigen::Index>(points.size()));
  for (Eigen::Index i = 0; i < centred.cols(); ++i)
    centred.col(i) = points[static_cast<std::size_t>(i)] - mean;
  return spread_of(centred);
}

/// Cost of a sphere's centre: sum of squared deviations in sigmas, linear beyond kNominalOffM.
class CentreCost {
 public:
  CentreCost(const std::vector<Eigen::Vector3d>& points_m, const std::vector<double>& radius_m,
             const CentreHints& hints, double point_sigma_m)
      : points_m_(points_m),
        radius_m_(radius_m),
        outwards_(hints.outwards),
        mean_m_(mean_of_points(points_m)),
        weight_(1.0 / (point_sigma_m * point_sigma_m)) {
    if (hints.stated_m == nullptr || !(hints.stated_sigma_m > 0.0)) return;
    stated_m_ = *hints.stated_m;
    prior_ = 1.0 / (hints.stated_sigma_m * hints.stated_sigma_m);
  }

  double operator()(const Eigen::Vector3d& centre_m) const {  // (16)
    double sum = prior_ * (centre_m - stated_m_).squaredNorm();
    for (std::size_t i = 0; i < points_m_.size(); ++i) {
      const double off = ((points_m_[i] - centre_m).norm() - radius_m_[i]) / kNominalOffM;
      sum += 2.0 * weight_ * kNominalOffM * kNominalOffM * (std::sqrt(1.0 + off * off) - 1.0);
    }
    constexpr double kWrongSide = 25.0;  // five sigma
    return sum + (outwards_.dot(mean_m_ - centre_m) < 0.0 ? kWrongSide : 0.0);
  }

  /// Gauss-Newton from `begin_m`, which is returned if the steps diverge.
  Eigen::Vector3d settled(const Eigen::Vector3d& begin_m) const {
    Eigen::Vector3d centre = begin_m;
    for (int k = 0; k < kIterations; ++k) {
      Eigen::Matrix3d information = prior_ * Eigen::Matrix3d::Identity();
      Eigen::Vector3d right = prior_ * (stated_m_ - centre);
      for (std::size_t i = 0; i < points_m_.size(); ++i) {
        const Eigen::Vector3d d = points_m_[i] - centre;
        const double length = std::max(d.norm(), 1e-12), off = length - radius_m_[i];
        const Eigen::Vector3d j = -d / length;
        const Eigen::Vector3d weighted =
            weight_ / std::sqrt(1.0 + std::pow(off / kNominalOffM, 2)) * j;
        information += weighted * j.transpose();
        right -= off * weighted;
      }
      const Eigen::Vector3d step = information.ldlt().solve(right);
      if (!(step.norm() < kDivergedStepM)) return begin_m;
      centre += step;
      if (step.norm() < kSettledM) break;
    }
    return centre;
  }

 private:
  const std::vector<Eigen::Vector3d>& points_m_;
  const std::vector<double>& radius_m_;
  Eigen::Vector3d outwards_, mean_m_, stated_m_ = Eigen::Vector3d::Zero();
  double weight_, prior_ = 0.0;
};

}  // namespace

std::vector<std::size_t> of_one_target(std::size_t count, const Together& together) {
  constexpr std::size_t kAsked = 64;  // of many touches, for a time linear in their number
  const std::size_t every = std::max<std::size_t>(1, count / kAsked);
  std::vector<std::size_t> most;
  for (std::size_t one = 0; one < count && most.size() < count; one += every) {
    std::vector<std::size_t> its;
    for (std::size_t i = 0; i < count; ++i)
      if (i == one || together(one, i)) its.push_back(i);
    if (its.size() > most.size()) most = std::move(its);
  }
  return most;
}

SphereFit fit_centre(const std::vector<Eigen::Vector3d>& points_m,
                     const std::vector<double>& radius_m, const CentreHints& hints,
                     double point_sigma_m) {
  SphereFit fit;
  const auto n = static_cast<Eigen::Index>(points_m.size());
  const Eigen::Vector3d mean = mean_of_points(points_m);
  fit.centre_m = hints.stated_m != nullptr ? *hints.stated_m : mean;
  if (n == 0) return fit;

  // |p - c|^2 = r_c^2, centred on the mean: 2 p.c + (r_0^2 - |c|^2) = |p|^2 + r_0^2 - r_c^2
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
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(scatter);
  const Eigen::Vector3d square = axes.eigenvalues();
  fit.determined = n >= 4 && square[2] > 0.0 && square[0] >= kFlat * kFlat * square[2];
  const bool around = fit.determined && square[0] >= kAround * kAround * square[2];
  std::vector<Eigen::Vector3d> begins;
  if (hints.stated_m != nullptr && !around && (fit.determined || hints.stated_sigma_m > 0.0))
    begins.push_back(*hints.stated_m);
  if (fit.determined) {
    const Eigen::Vector3d linear = mean + least_squares(a, b).head<3>();
    const Eigen::Vector3d across = axes.eigenvectors().col(0);
    begins.push_back(linear);
    if (!around) begins.push_back(linear - 2.0 * across.dot(linear - mean) * across);
  }
  const CentreCost cost(points_m, radius_m, hints, point_sigma_m);
  double least = std::numeric_limits<double>::max();
  for (const Eigen::Vector3d& begin : begins) {
    const Eigen::Vector3d centre = cost.settled(begin);
    const double its = cost(centre);
    if (!(its < least)) continue;
    least = its;
    fit.centre_m = centre;
  }
  return fit;
}

PlaneFit fit_plane(const std::vector<Eigen::Vector3d>& points_m) {
  PlaneFit fit;
  if (points_m.empty()) return fit;
  fit.middle_m = mean_of_points(points_m);
  if (points_m.size() < 3) return fit;
  const auto [s, directions] = spread_about(fit.middle_m, points_m);
  fit.normal = directions.col(2);
  fit.determined = s[1] > kFlat * s[0] && s[2] < kThick * s[1];
  return fit;
}

FrameFit fit_frame(const std::vector<Eigen::Vector3d>& readings_m,
                   const std::vector<Eigen::Vector3d>& points_m) {
  FrameFit fit;
  if (readings_m.empty()) return fit;
  fit.middle_m = mean_of_points(readings_m);
  fit.frame.translation() = mean_of_points(points_m) - fit.middle_m;
  if (readings_m.size() < 3) return fit;
  const Eigen::VectorXd s = spread_about(fit.middle_m, readings_m).values;
  fit.determined = s[1] > kThin * s[0];
  if (!fit.determined) return fit;
  Eigen::Matrix3Xd from(3, static_cast<Eigen::Index>(readings_m.size())), to(from);
  for (Eigen::Index i = 0; i < from.cols(); ++i) {
    from.col(i) = readings_m[static_cast<std::size_t>(i)];
    to.col(i) = points_m[static_cast<std::size_t>(i)];
  }
  const Eigen::Matrix4d motion = rigid_motion(from, to).matrix();
  if (motion.allFinite()) fit.frame.matrix() = motion;
  return fit;
}

}  // namespace cellcal::calib
