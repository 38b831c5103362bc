#include "calib/check/base_relation.h"

#include <fmt/format.h>

#include <Eigen/QR>
#include <algorithm>
#include <cmath>

#include "calib/estimate/region.h"
#include "calib/model/error.h"
#include "calib/model/linear.h"
#include "calib/model/units.h"

namespace cellcal::calib {

namespace {

using Eigen::Isometry3d;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using Indices = std::vector<Eigen::Index>;

constexpr int kFramePoses = 200;
constexpr unsigned kFrameSeed = 20261127;
/// Form and mount of a sphere, per component; also keeps the weights finite.
constexpr double kFormM = 1e-6;
constexpr Eigen::Index kBase = 6;
constexpr std::size_t kLeastSpheres = 3;

IdentifyError undetermined(const std::string& words) {
  return {IdentifyError::Kind::kUndetermined, words};
}

/// 99.9 % of chi^2, by the cube root's normal approximation (Wilson, Hilferty 1931).
double largest_by_chance(int degrees_of_freedom) {
  constexpr double kNormal999 = 3.0902323;
  const double h = 2.0 / (9.0 * degrees_of_freedom);
  return degrees_of_freedom * std::pow(1.0 - h + kNormal999 * std::sqrt(h), 3);
}

const TargetResult& target_of(const Calibration& c, const std::string& id) {
  const auto found = std::ranges::find(c.targets, id, &TargetResult::id);
  if (found == c.targets.end())
    throw undetermined(
        fmt::format("no target \"{}\" in the calibration of {}. Give the id of a "
                    "sphere that this arm touched",
                    id, c.cell.robot.name));
  if (found->kind != TargetKind::kSphere)
    throw IdentifyError(IdentifyError::Kind::kCell, id,
                        fmt::format("{} is a {}: two arms are related by spheres alone", id,
                                    to_string(found->kind)));
  return *found;
}

/// Motion of the base, per unit of each parameter of the arm, that takes up most of it over the workspace.
MatrixXd taken_up_by_base(const ArmModel& arm, const VectorXd& x) {
  const auto poses = workspace_poses(arm, kFramePoses, kFrameSeed);
  if (poses.size() < kLeastSpheres)
    throw undetermined("the arm of " + arm.robot().name + " has no workspace to fix its base in");
  const TipMoves at = tip_moves(arm, poses, x.data());
  const MatrixXd rigid = base_motions(at.tips_m);
  return least_squares(rigid, at.moves_m);
}

/// Derivative of the centres, less that of the base, by all parameters of the calibration.
MatrixXd moves_in_base(const Calibration& c, std::span<const std::string> ids,
                       const Eigen::Matrix3Xd& centre_m) {
  const ArmModel arm(at_level(c.cell, c.level));
  const MatrixXd taken_up = taken_up_by_base(arm, arm_values(arm, c));
  MatrixXd moves = MatrixXd::Zero(3 * centre_m.cols(), c.covariance.rows());
  for (std::size_t p = 0; p < c.parameters.size(); ++p) {
    const ParameterKey& key = c.parameters[p].key;
    const auto column = static_cast<Eigen::Index>(p);
    const auto own = std::ranges::find(
        arm.parameters(), key, [](const ArmParameter& one) -> const ParameterKey& { return one; });
    const auto of_arm = static_cast<Eigen::Index>(own - arm.parameters().begin());
    for (Eigen::Index k = 0; k < centre_m.cols(); ++k) {
      if (own != arm.parameters().end())
        moves.col(column).segment<3>(3 * k) = -base_motion(centre_m.col(k)) * taken_up.col(of_arm);
      else if (key.kind == ParameterKind::kCentre &&
               c.cell.targets[static_cast<std::size_t>(key.target)].id ==
                   ids[static_cast<std::size_t>(k)])
        moves(3 * k + key.axis, column) = 1.0;
    }
  }
  return moves;
}

/// How far they are off one line, rms.
double off_line_m(const Eigen::Matrix3Xd& centre_m) {
  const Eigen::Matrix3Xd about = centre_m.colwise() - centre_m.rowwise().mean();
  return spread_of(about).values[1] / std::sqrt(static_cast<double>(centre_m.cols()));
}

void require_off_line(const Eigen::Matrix3Xd& centre_m, const std::string& robot) {
  const double rms_m = off_line_m(centre_m);
  if (rms_m >= kLeastOffLineM) return;
  throw undetermined(fmt::format(
      "the common spheres are {:.1f} mm off one line ({}), and {:.0f} mm are needed: they hold no rotation about it. "
      "Touch another sphere with both arms, beside that line",
      rms_m * kMmPerM, robot, kLeastOffLineM * kMmPerM));
}

void require_same_diameter(const Calibration& first, const Calibration& second,
                           const SpherePair& sphere) {
  constexpr double kSigmas = 3.0;
  const Target &one = first.cell.targets[first.cell.target_index(sphere.first)],
               &other = second.cell.targets[second.cell.target_index(sphere.second)];
  const double allowed =
      kSigmas * std::hypot(one.diameter_sigma_m, other.diameter_sigma_m) + kFormM;
  if (std::abs(one.diameter_m - other.diameter_m) <= allowed) return;
  throw IdentifyError(
      IdentifyError::Kind::kCell, sphere.first,
      fmt::format(
          "{}: diameter {:.4f} mm in the first calibration, {:.4f} mm in the second ({}), {:.4f} mm apart at "
          "most by their sigmas. Another sphere of that name, or a wrong diameter: correct the cell file and "
          "identify again, or name the pairs",
          sphere.first, one.diameter_m * kMmPerM, other.diameter_m * kMmPerM, sphere.second,
          allowed * kMmPerM));
}

/// Centres of the spheres in the base frame, and their covariance with the motion of the base taken out.
struct CentresInBase {
  Eigen::Matrix3Xd centre_m;
  MatrixXd covariance;  ///< 3 per sphere [m^2]
};

CentresInBase centres_in_base(const Calibration& c, std::span<const std::string> ids) {
  refuse_external_axes(c.cell.robot, "a relation of two bases",
                       "Measure the frame between the arms at the controllers");
  if (c.covariance.size() == 0)
    throw undetermined("the calibration of " + c.cell.robot.name +
                       " states no covariance. Identify it again");
  CentresInBase found;
  found.centre_m.resize(3, static_cast<Eigen::Index>(ids.size()));
  for (std::size_t i = 0; i < ids.size(); ++i)
    found.centre_m.col(static_cast<Eigen::Index>(i)) = target_of(c, ids[i]).centre_m;
  const MatrixXd moves = moves_in_base(c, ids, found.centre_m);  // (100)
  found.covariance = moves * c.covariance * moves.transpose();
  return found;
}

/// Weighted rigid fit with some spheres freed, each by a shift of its own.
class RigidFit {
 public:
  RigidFit(const CentresInBase& first, const CentresInBase& second)
      : first_(first), second_(second), at_(rigid_motion(second.centre_m, first.centre_m)) {}

  struct Solution {
    VectorXd x;  ///< step of the base (shift, turn about `middle_m`), then the freed shifts
    MatrixXd covariance;
    VectorXd left_m;  ///< residuals, and their covariance
    MatrixXd left_covariance;
    double chi2 = 0.0;
    int degrees_of_freedom = 0;
  };

  /// (101), until the step is below rounding.
  Solution solve(const Indices& freed);
  /// The same without a step.
  Solution linear(const Indices& freed) const;
  const Isometry3d& at() const { return at_; }
  Vector3d middle_m() const { return middle_m_; }
  VectorXd off_m() const;

 private:
  const CentresInBase& first_;
  const CentresInBase& second_;
  Isometry3d at_;
  Vector3d middle_m_ = Vector3d::Zero();
};

VectorXd RigidFit::off_m() const {
  const Eigen::Matrix3Xd off =
      ((at_.linear() * second_.centre_m).colwise() + at_.translation()) - first_.centre_m;
  return off.reshaped();
}

RigidFit::Solution RigidFit::linear(const Indices& freed) const {
  const Eigen::Index count = first_.centre_m.cols();
  MatrixXd v = first_.covariance;
  for (Eigen::Index i = 0; i < count; ++i)
    for (Eigen::Index k = 0; k < count; ++k)
      v.block<3, 3>(3 * i, 3 * k) +=
          at_.linear() * second_.covariance.block<3, 3>(3 * i, 3 * k) * at_.linear().transpose();
  v.diagonal().array() += 2.0 * kFormM * kFormM;
  const auto shifts = static_cast<Eigen::Index>(freed.size());
  MatrixXd j = MatrixXd::Zero(3 * count, kBase + 3 * shifts);
  for (Eigen::Index i = 0; i < count; ++i)
    j.block<3, kBase>(3 * i, 0) = base_motion(first_.centre_m.col(i) - middle_m_);
  for (Eigen::Index f = 0; f < shifts; ++f)
    j.block<3, 3>(3 * freed[static_cast<std::size_t>(f)], kBase + 3 * f).setIdentity();
  const Cholesky root(v);
  const MatrixXd whitened = root.whitened(j);
  const VectorXd off = root.whitened(off_m());
  const Eigen::CompleteOrthogonalDecomposition<MatrixXd> rows(whitened);
  const MatrixXd inverse = rows.pseudoInverse();
  Solution found;
  found.x = -inverse * off;
  found.covariance = inverse * inverse.transpose();
  found.left_m = off_m() + j * found.x;
  found.left_covariance = v - j * found.covariance * j.transpose();
  found.chi2 = (off + whitened * found.x).squaredNorm();
  found.degrees_of_freedom = static_cast<int>(off.size() - rows.rank());
  return found;
}

RigidFit::Solution RigidFit::solve(const Indices& freed) {
  constexpr int kMostSteps = 20;
  constexpr double kRoundingM = 1e-12;
  middle_m_.setZero();
  Eigen::Index used = 0;
  for (Eigen::Index i = 0; i < first_.centre_m.cols(); ++i) {
    if (std::ranges::find(freed, i) != freed.end()) continue;
    middle_m_ += first_.centre_m.col(i);
    ++used;
  }
  middle_m_ /= static_cast<double>(used);
  Solution found = linear(freed);
  for (int step = 0; step < kMostSteps; ++step) {
    const Vector3d shift = found.x.head<3>();
    const Isometry3d about_middle = Eigen::Translation3d(middle_m_ + shift) *
                                    Isometry3d(turn(found.x.segment<3>(3))) *
                                    Eigen::Translation3d(-middle_m_);
    at_ = about_middle * at_;
    const double moved = found.x.head<kBase>().norm();
    found = linear(freed);
    if (moved < kRoundingM) break;
  }
  return found;
}

Eigen::Matrix3Xd without(const Eigen::Matrix3Xd& all, const Indices& freed) {
  Eigen::Matrix3Xd rest(3, all.cols() - static_cast<Eigen::Index>(freed.size()));
  Eigen::Index to = 0;
  for (Eigen::Index i = 0; i < all.cols(); ++i)
    if (std::ranges::find(freed, i) == freed.end()) rest.col(to++) = all.col(i);
  return rest;
}

bool hold_a_base(const Eigen::Matrix3Xd& centre_m) {
  return centre_m.cols() >= static_cast<Eigen::Index>(kLeastSpheres) &&
         off_line_m(centre_m) >= kLeastOffLineM;
}

/// Which spheres are left out, and which of the others may be the wrong one.
struct Blame {
  Indices freed, suspects;
};

/// The sphere whose own shift explains most is freed, until the others agree or too few are left.
Blame find_blame(RigidFit& fit, const Eigen::Matrix3Xd& centre_m) {
  Blame blame;
  while (true) {
    const RigidFit::Solution all = fit.solve(blame.freed);
    if (all.degrees_of_freedom == 0 || all.chi2 <= largest_by_chance(all.degrees_of_freedom))
      return blame;
    Indices best = blame.freed, suspects;
    double least = all.chi2;
    for (Eigen::Index i = 0; i < centre_m.cols(); ++i) {
      if (std::ranges::find(blame.freed, i) != blame.freed.end()) continue;
      Indices more = blame.freed;
      more.push_back(i);
      const RigidFit::Solution one = fit.linear(more);
      if (one.degrees_of_freedom > 0 && one.chi2 <= largest_by_chance(one.degrees_of_freedom))
        suspects.push_back(i);
      if (one.chi2 >= least || !hold_a_base(without(centre_m, more))) continue;
      least = one.chi2;
      best = more;
    }
    if (best.size() == blame.freed.size()) {
      blame.suspects = suspects;
      if (suspects.empty())
        for (Eigen::Index i = 0; i < centre_m.cols(); ++i) blame.suspects.push_back(i);
      return blame;
    }
    blame.freed = best;
  }
}

/// Shift of a freed sphere, residual of any other; its significance is the drop of chi^2 where it is freed.
RelatedSphere related(const SpherePair& sphere, Eigen::Index i, const RigidFit& fit,
                      const Blame& blame) {
  RelatedSphere one{.sphere = sphere};
  Indices others = blame.freed;
  one.agrees = std::erase(others, i) == 0;
  one.suspect = std::ranges::find(blame.suspects, i) != blame.suspects.end();
  const RigidFit::Solution held = fit.linear(others);
  others.push_back(i);
  const RigidFit::Solution free = fit.linear(others);
  const Eigen::Index own = free.x.size() - 3;
  one.off_m =
      one.agrees ? Vector3d(held.left_m.segment<3>(3 * i)) : Vector3d(-free.x.segment<3>(own));
  const Matrix3d covariance = one.agrees ? held.left_covariance.block<3, 3>(3 * i, 3 * i)
                                         : free.covariance.block<3, 3>(own, own);
  one.u_m = 2.0 * std::sqrt(std::max(0.0, covariance.trace()));
  one.sigmas = std::sqrt(std::max(0.0, held.chi2 - free.chi2));
  return one;
}

}  // namespace

bool BaseRelation::agrees() const {
  return std::ranges::all_of(spheres,
                             [](const RelatedSphere& one) { return one.agrees && !one.suspect; });
}

BaseRelation relate_bases(const Calibration& first, const Calibration& second,
                          std::span<const SpherePair> spheres) {
  if (spheres.size() < kLeastSpheres)
    throw undetermined(fmt::format(
        "{} common sphere{}, 3 are needed that are not on one line. Touch the same spheres "
        "with both arms",
        spheres.size(), spheres.size() == 1 ? "" : "s"));
  std::vector<std::string> first_ids, second_ids;
  for (const SpherePair& one : spheres) {
    first_ids.push_back(one.first);
    second_ids.push_back(one.second);
  }
  const CentresInBase one = centres_in_base(first, first_ids),
                      other = centres_in_base(second, second_ids);
  for (const SpherePair& pair : spheres) require_same_diameter(first, second, pair);
  require_off_line(one.centre_m, first.cell.robot.name);
  require_off_line(other.centre_m, second.cell.robot.name);
  RigidFit fit(one, other);
  const Blame blame = find_blame(fit, one.centre_m);
  const RigidFit::Solution found = fit.solve(blame.freed);
  BaseRelation relation;
  relation.second_in_first = fit.at();
  relation.chi2 = found.chi2;
  relation.degrees_of_freedom = found.degrees_of_freedom;
  relation.middle_m = fit.middle_m();
  relation.middle_covariance = found.covariance.topLeftCorner<3, 3>();
  Eigen::Matrix<double, 6, 6> to_origin = Eigen::Matrix<double, 6, 6>::Identity();
  to_origin.topRows<3>() = base_motion(fit.at().translation() - fit.middle_m());
  relation.covariance = to_origin * found.covariance.topLeftCorner<6, 6>() * to_origin.transpose();
  for (std::size_t i = 0; i < spheres.size(); ++i)
    relation.spheres.push_back(related(spheres[i], static_cast<Eigen::Index>(i), fit, blame));
  return relation;
}

}  // namespace cellcal::calib
