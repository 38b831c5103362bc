#include "sim/cell/compare.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "calib/estimate/predict.h"
#include "calib/estimate/region.h"
#include "calib/model/iso_time.h"
#include "calib/model/linear.h"
#include "sim/cell/physical_cell.h"

namespace cellcal::sim {

namespace {

constexpr int kWorkspacePoses = 1000;
constexpr int kLocalPoses = 300;
constexpr double kWarmedUp = 1.0;
constexpr unsigned kSeed = 4711;  // differs from the estimator's: other poses than it predicted for

/// Norms of the residuals after the best rigid motion of `points` onto `truth`.
Eigen::VectorXd aligned_errors(const Eigen::Matrix3Xd& points, const Eigen::Matrix3Xd& truth) {
  const Eigen::Matrix4d motion = calib::rigid_motion(points, truth).matrix();
  return ((motion.topLeftCorner<3, 3>() * points).colwise() + motion.topRightCorner<3, 1>() - truth)
      .colwise()
      .norm()
      .transpose();
}

RegionFigures figures(const Truth& truth, const calib::Predictor& predictor,
                      const std::vector<calib::JointVector>& poses) {
  RegionFigures f;
  f.poses = static_cast<int>(poses.size());
  if (f.poses < 4) return f;
  Eigen::Matrix3Xd real(3, f.poses), calibrated(3, f.poses);
  Eigen::VectorXd u95(f.poses);
  const PhysicalCell real_cell(truth);
  for (int i = 0; i < f.poses; ++i) {
    const auto& q = poses[static_cast<std::size_t>(i)];
    const calib::Prediction p = predictor.calibrated(q);
    real.col(i) = real_cell.tip_m(q, kWarmedUp);
    calibrated.col(i) = p.tcp.translation();
    u95[i] = p.u95_m;
  }
  const Eigen::VectorXd error = aligned_errors(calibrated, real);
  f.mean_m = error.mean();
  f.max_m = error.maxCoeff();
  f.rms_m = std::sqrt(error.squaredNorm() / f.poses);
  f.covered = static_cast<double>((error.array() <= u95.array()).count()) / f.poses;
  return f;
}

void add_nominal(const Truth& truth, const calib::Predictor& predictor,
                 const std::vector<calib::JointVector>& poses, RegionFigures& f) {
  const auto count = static_cast<Eigen::Index>(poses.size());
  if (count < 4) return;
  Eigen::Matrix3Xd real(3, count), nominal(3, count);
  const PhysicalCell real_cell(truth);
  for (Eigen::Index i = 0; i < count; ++i) {
    const auto& q = poses[static_cast<std::size_t>(i)];
    real.col(i) = real_cell.tip_m(q, kWarmedUp);
    nominal.col(i) = predictor.nominal(q).translation();
  }
  const Eigen::VectorXd error = aligned_errors(nominal, real);
  f.nominal_mean_m = error.mean();
  f.nominal_max_m = error.maxCoeff();
}

}  // namespace

SurfaceFigures surface_figures(const Truth& truth, const std::vector<calib::Touch>& touches) {
  const PhysicalCell cell(truth);
  SurfaceFigures f;
  for (const calib::Touch& touch : touches) {
    const auto begin = calib::seconds_of(touches.front().time), now = calib::seconds_of(touch.time);
    const double warm = begin && now ? truth.warm_at(*now - *begin) : kWarmedUp;
    calib::JointVector at = touch.joint_rad;
    at.insert(at.end(), touch.positioner_rad.begin(), touch.positioner_rad.end());
    const double off_m = std::abs(cell.gap_m(at, warm));
    f.mean_m += off_m / static_cast<double>(touches.size());
    f.max_m = std::max(f.max_m, off_m);
    f.bad += off_m > kBadM ? 1 : 0;
  }
  return f;
}

TruthFigures truth_figures(const Truth& truth, const calib::Calibration& calibration,
                           const std::vector<calib::JointVector>& around) {
  const calib::Predictor predictor(calibration);
  const calib::ArmModel nominal(calibration.cell.robot, calibration.cell.tool);
  std::vector<Eigen::Vector3d> centres;
  for (const calib::TargetResult& target : calibration.targets) {
    if (calib::has_a_centre(target.kind)) {
      centres.push_back(target.centre_m);
      continue;
    }
    for (const calib::JointVector& q : around)  // each is where it was touched
      centres.push_back(nominal.nominal_tcp(q).translation());
  }
  const auto near = [&](int count) {
    return calib::local_poses(nominal, around, centres, count, kSeed);
  };
  const auto anywhere = [&](int count) { return calib::workspace_poses(nominal, count, kSeed); };
  TruthFigures result;
  result.workspace = figures(truth, predictor, anywhere(kWorkspacePoses));
  result.local = figures(truth, predictor, near(kLocalPoses));
  add_nominal(truth, predictor, anywhere(kNominalPoses), result.workspace);
  add_nominal(truth, predictor, near(kNominalPoses), result.local);
  return result;
}

}  // namespace cellcal::sim
