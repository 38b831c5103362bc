#include "calib/verdict/judge/held_places.h"

#include <algorithm>
#include <cmath>

#include "calib/linear/eigenpairs.h"
#include "calib/problem/solve.h"

namespace cellcal::calib {

namespace {

/// With a perfect arm a target's touches would hold its place to sigma / sqrt(n lambda), lambda the
/// smallest eigenvalue of the mean of the outer products of what they say about it. Where that is
/// worse than this they say more about the target's place than about the arm.
constexpr double kPlaceSigmaM = 0.3e-3;
/// At this distance, where a target turns: the region that counts as near it.
constexpr double kPlaceLeverM = 0.150;
/// A tracker measures lengths itself, and so does a wire. Their touches hold the scale where, with
/// a perfect arm, they would hold it to this; a tracker's from at least this many places.
constexpr double kScaleSigma = 1e-4;
constexpr int kScalePlaces = 4;

/// Fit touches of a block that are in use.
std::vector<std::size_t> used_touches(const Problem& problem, const Calibration& c, int block) {
  std::vector<std::size_t> used;
  for (const TouchResidual& r : c.residuals)
    if (problem.block_of(r.touch) == block && !r.outlier &&
        problem.touches()[r.touch].set == TouchSet::kFit)
      used.push_back(r.touch);
  return used;
}

/// Smallest eigenvalue of what these touches say about the place of their target [1/m^2].
double least_information(const Problem& problem, const Eigen::VectorXd& x, const TargetBlock& block,
                         const std::vector<std::size_t>& touches) {
  const TargetKind kind = problem.cell().targets[block.target].kind;
  Eigen::VectorXd lever = Eigen::VectorXd::Ones(block.place);
  if (kind == TargetKind::kPlane) lever.head<2>().setConstant(kPlaceLeverM);
  if (kind == TargetKind::kTracker) lever.tail<3>().setConstant(kPlaceLeverM);
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(block.place, block.place);
  const Problem::At at = problem.at(x.data());
  double r[Problem::kMostRows], by_target[Problem::kMostRows * TargetBlock::kMost];
  for (const std::size_t i : touches) {
    problem.residual_m(i, at, r, nullptr, by_target);
    const Eigen::MatrixXd j =
        Eigen::Map<const RowMajor>(by_target, problem.place_rows(i), block.size())
            .leftCols(block.place) *
        lever.cwiseInverse().asDiagonal();
    information += j.transpose() * j / std::pow(problem.sigma_m(i), 2);
  }
  return eigenpairs(information).values[0];  // (56)
}

/// Wires as long as what is to be measured with them; one as short as a sphere's radius is no rule.
bool wire_holds_scale(const Problem& problem, const std::vector<std::size_t>& touches) {
  double information = 0.0;
  for (const std::size_t i : touches)
    if (const double length_m = problem.touches()[i].radius_m; length_m > kPlaceLeverM)
      information += std::pow(length_m / problem.sigma_m(i), 2);  // (55)
  return information * kScaleSigma * kScaleSigma > 1.0;
}

bool tracker_holds_scale(const Problem& problem, const std::vector<std::size_t>& touches) {
  std::vector<Eigen::Vector3d> readings;
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const std::size_t i : touches) {
    const double* m = problem.touches()[i].tracker_m;
    const Eigen::Vector3d reading(m[0], m[1], m[2]);
    // A place that was visited again is no other place.
    if (std::none_of(readings.begin(), readings.end(), [&](const Eigen::Vector3d& other) {
          return (other - reading).norm() < kPlaceLeverM;
        }))
      readings.push_back(reading);
    middle += reading / static_cast<double>(touches.size());
  }
  if (static_cast<int>(readings.size()) < kScalePlaces) return false;
  double information = 0.0;
  for (const std::size_t i : touches)
    information +=  // (55)
        (Eigen::Map<const Eigen::Vector3d>(problem.touches()[i].tracker_m) - middle).squaredNorm() /
        std::pow(problem.sigma_m(i), 2);
  return information * kScaleSigma * kScaleSigma > 1.0;
}

}  // namespace

HeldPlaces judge_places(const Problem& problem, const Calibration& c,
                        std::vector<Finding>& findings) {
  Eigen::VectorXd x(problem.size());
  for (int i = 0; i < problem.size(); ++i) {
    const ParameterResult& found = c.parameters[static_cast<std::size_t>(i)];
    x[i] = found.nominal + found.correction;
  }
  HeldPlaces held;
  for (std::size_t b = 0; b < problem.blocks().size(); ++b) {
    const TargetBlock& block = problem.blocks()[b];
    const Target& target = problem.cell().targets[block.target];
    if (target.kind == TargetKind::kPoint) continue;  // one touch tells all three directions
    const auto used = used_touches(problem, c, static_cast<int>(b));
    if (target.kind == TargetKind::kTracker && tracker_holds_scale(problem, used)) {
      held.rule = &target;
      ++held.trackers;
    }
    if (target.kind == TargetKind::kWire && wire_holds_scale(problem, used)) {
      held.rule = &target;
      ++held.wires;
    }
    if (least_information(problem, x, block, used) * kPlaceSigmaM * kPlaceSigmaM > 1.0) continue;
    held.loose.push_back(static_cast<int>(b));
    findings.push_back({used.empty() ? FindingKind::kAllLeftOut : FindingKind::kTooFewDirections,
                        Severity::kWithholds,
                        about_target(target),
                        {{"touches", static_cast<double>(used.size()), ""}}});
  }
  return held;
}

}  // namespace cellcal::calib
