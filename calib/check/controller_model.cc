#include "calib/check/controller_model.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

#include "calib/model/nominal_arm.h"
#include "calib/model/units.h"
#include "calib/result/finding_phrase.h"

namespace cellcal::calib {

namespace {

using Eigen::Isometry3d;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Quaterniond;
using Eigen::Vector3d;
using Eigen::VectorXd;
using Motion = Eigen::Matrix<double, 6, 1>;

/// A rotation counts as its arc at this distance: a tool's length.
constexpr double kLeverM = 0.3;
constexpr int kFrameSteps = 30;
constexpr double kFrameSettled = 1e-12;
/// Relative to the best determined combination of tool and base.
constexpr double kFrameDetermined = 1e-4;
constexpr Eigen::Index kFrameUnknowns = 12;
constexpr std::size_t kFewestPostures = 4;
/// Frames are read on the pendant to a tenth of a millimetre.
constexpr double kSameFrameM = 1e-3;

struct PosturePair {
  Isometry3d flange, stated;
};

struct FrameFit {
  Isometry3d tool = Isometry3d::Identity(), root_to_base = Isometry3d::Identity();  ///< T, B^-1
  double square = 0.0;
  bool determined = false;
};

Isometry3d small_motion(const Vector3d& shift, const Vector3d& by_rad) {
  Isometry3d step = Isometry3d::Identity();
  step.translation() = shift;
  step.linear() = turn(by_rad);
  return step;
}

Isometry3d predicted_tcp(const FrameFit& fit, const PosturePair& at) {
  return fit.root_to_base * at.flange * fit.tool;
}

/// Position and rotation vector of the stated TCP in the predicted one; rotations times the lever.
Motion tcp_residual(const Isometry3d& predicted, const Isometry3d& stated) {
  const Isometry3d off = predicted.inverse() * stated;
  Motion r;
  r << off.translation(), kLeverM * turn_vector(off.linear());
  return r;
}

double square_of_tcps(const FrameFit& fit, std::span<const PosturePair> pairs) {
  double sum = 0.0;
  for (const PosturePair& one : pairs)
    sum += tcp_residual(predicted_tcp(fit, one), one.stated).squaredNorm();
  return sum;
}

/// Gauss-Newton from `fit`; combinations that the postures do not determine stay as they are.
FrameFit refined_frames(FrameFit fit, std::span<const PosturePair> pairs) {
  const auto rows = static_cast<Eigen::Index>(6 * pairs.size());
  fit.square = square_of_tcps(fit, pairs);
  for (int iteration = 0; iteration < kFrameSteps; ++iteration) {
    MatrixXd jacobian = MatrixXd::Zero(rows, kFrameUnknowns);
    VectorXd off(rows);
    for (std::size_t k = 0; k < pairs.size(); ++k) {
      const Isometry3d predicted = predicted_tcp(fit, pairs[k]);
      const auto row = static_cast<Eigen::Index>(6 * k);
      const Matrix3d back = predicted.linear().transpose();
      off.segment<6>(row) = tcp_residual(predicted, pairs[k].stated);
      jacobian.block<3, 3>(row, 0).setIdentity();
      jacobian.block<3, 3>(row + 3, 3) = kLeverM * Matrix3d::Identity();
      jacobian.block<3, 3>(row, 6) = back;
      jacobian.block<3, 3>(row, 9) = -back * cross_matrix(predicted.translation());
      jacobian.block<3, 3>(row + 3, 9) = kLeverM * back;
    }
    Eigen::CompleteOrthogonalDecomposition<MatrixXd> solver;
    solver.setThreshold(kFrameDetermined);
    solver.compute(jacobian);
    fit.determined = solver.rank() == kFrameUnknowns;
    const VectorXd step = solver.solve(off);
    FrameFit next = fit;
    next.tool = fit.tool * small_motion(step.segment<3>(0), step.segment<3>(3));
    next.root_to_base = small_motion(step.segment<3>(6), step.segment<3>(9)) * fit.root_to_base;
    next.square = square_of_tcps(next, pairs);
    if (!(next.square < fit.square)) break;
    const bool settled =
        fit.square - next.square < kFrameSettled * kFrameSettled + kFrameSettled * fit.square;
    fit = next;
    if (settled) break;
  }
  return fit;
}

Eigen::Matrix4d left_product(const Quaterniond& q) {
  Eigen::Matrix4d m;
  m << q.w(), -q.x(), -q.y(), -q.z(), q.x(), q.w(), -q.z(), q.y(), q.y(), q.z(), q.w(), -q.x(),
      q.z(), -q.y(), q.x(), q.w();
  return m;
}

Eigen::Matrix4d right_product(const Quaterniond& q) {
  Eigen::Matrix4d m;
  m << q.w(), -q.x(), -q.y(), -q.z(), q.x(), q.w(), q.z(), -q.y(), q.y(), -q.z(), q.w(), q.x(),
      q.z(), q.y(), -q.x(), q.w();
  return m;
}

/// Turns of flange and TCP between two postures, of one sign; near half a turn it is not defined.
std::optional<std::pair<Quaterniond, Quaterniond>> turns_between(const PosturePair& from,
                                                                 const PosturePair& to) {
  constexpr double kLeastReal = 0.1;
  Quaterniond a(from.flange.linear().transpose() * to.flange.linear());
  Quaterniond b(from.stated.linear().transpose() * to.stated.linear());
  if (std::abs(a.w()) < kLeastReal || std::abs(b.w()) < kLeastReal) return std::nullopt;
  if (a.w() < 0.0) a.coeffs() *= -1.0;
  if (b.w() < 0.0) b.coeffs() *= -1.0;
  return std::pair(a, b);
}

/// T of (F_i^-1 F_k) T = T (R_i^-1 R_k) in closed form, rotation first.
Isometry3d tool_of_motions(std::span<const PosturePair> pairs) {
  Eigen::Matrix4d squares = Eigen::Matrix4d::Zero();
  std::vector<std::pair<const PosturePair*, const PosturePair*>> motions;
  for (std::size_t k = 1; k < pairs.size(); ++k)
    for (const std::size_t from : {std::size_t{0}, k - 1})
      motions.emplace_back(&pairs[from], &pairs[k]);
  for (const auto& [from, to] : motions) {
    const auto both = turns_between(*from, *to);
    if (!both) continue;
    const Eigen::Matrix4d difference = left_product(both->first) - right_product(both->second);
    squares += difference.transpose() * difference;
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix4d> solver(squares);
  const Eigen::Vector4d q = solver.eigenvectors().col(0);
  Isometry3d tool = Isometry3d::Identity();
  tool.linear() = Quaterniond(q[0], q[1], q[2], q[3]).normalized().toRotationMatrix();
  MatrixXd lever(3 * motions.size(), 3);
  VectorXd shift(3 * motions.size());
  for (std::size_t i = 0; i < motions.size(); ++i) {
    const Isometry3d a = motions[i].first->flange.inverse() * motions[i].second->flange;
    const Isometry3d b = motions[i].first->stated.inverse() * motions[i].second->stated;
    const auto row = static_cast<Eigen::Index>(3 * i);
    lever.block<3, 3>(row, 0) = a.linear() - Matrix3d::Identity();
    shift.segment<3>(row) = tool.linear() * b.translation() - a.translation();
  }
  Eigen::CompleteOrthogonalDecomposition<MatrixXd> translation;
  translation.setThreshold(kFrameDetermined);
  translation.compute(lever);
  tool.translation() = translation.solve(shift);
  return tool;
}

FrameFit from_tool(const Isometry3d& tool, std::span<const PosturePair> pairs) {
  FrameFit fit;
  fit.tool = tool;
  fit.root_to_base = pairs[0].stated * (pairs[0].flange * tool).inverse();
  return refined_frames(fit, pairs);
}

/// The better one of two starts: the known tool, and the closed form.
FrameFit estimated_frames(std::span<const PosturePair> pairs, const Isometry3d& tool) {
  const FrameFit one = from_tool(tool, pairs);
  if (pairs.size() < 2) return one;
  const FrameFit other = from_tool(tool_of_motions(pairs), pairs);
  return other.square < one.square ? other : one;
}

/// Sets `worst_m` and its posture.
void note_worst(const FrameFit& fit, std::span<const PosturePair> pairs,
                std::span<const StatedPose> poses, ControllerModel& model) {
  model.worst_m = -1.0;
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    const double off =
        (predicted_tcp(fit, pairs[k]).translation() - pairs[k].stated.translation()).norm();
    if (off <= model.worst_m) continue;
    model.worst_m = off;
    model.worst_rad = poses[k].joint_rad;
  }
}

std::vector<PosturePair> pairs_of(const Robot& robot, std::span<const StatedPose> poses) {
  const NominalArm arm(robot, Isometry3d::Identity());
  std::vector<PosturePair> pairs;
  for (const StatedPose& pose : poses) {
    if (pose.joint_rad.size() != arm.joint_count())
      throw std::invalid_argument("a stated pose has another number of joints than the robot");
    pairs.push_back({arm.tcp(pose.joint_rad), pose.tcp});
  }
  return pairs;
}

double origins_apart(const Isometry3d& a, const Isometry3d& b) {
  return (a.translation() - b.translation()).norm();
}

/// The model agrees with these frames; compares them with the known ones.
ControllerModel::Outcome compared_frames(const FrameFit& fit, const StatedFrames& known,
                                         ControllerModel& model) {
  if (known.tool) model.tool_off_m = origins_apart(fit.tool, *known.tool);
  if (known.base) model.base_off_m = origins_apart(fit.root_to_base.inverse(), *known.base);
  const bool other =
      model.tool_off_m.value_or(0.0) > kSameFrameM || model.base_off_m.value_or(0.0) > kSameFrameM;
  return other ? ControllerModel::Outcome::kOtherFrames : ControllerModel::Outcome::kAgrees;
}

/// "A1 12.0, A2 -90.0 deg"
std::string posture_words(const Robot& robot, const JointVector& joint_rad) {
  std::string words;
  for (std::size_t i = 0; i < joint_rad.size() && i < robot.joints.size(); ++i)
    words += fmt::format("{}{} {:.1f}", words.empty() ? "" : ", ", robot.joints[i].name,
                         joint_rad[i] * kDegPerRad);
  return words + " deg";
}

}  // namespace

ControllerModel compare_controller_model(const Robot& robot, std::span<const StatedPose> poses,
                                         const StatedFrames& known) {
  using enum ControllerModel::Outcome;
  refuse_external_axes(robot, "the comparison with the controller's model",
                       "State the poses with a robot file without it");
  ControllerModel model;
  model.postures = poses.size();
  if (poses.empty()) return model;
  const std::vector<PosturePair> pairs = pairs_of(robot, poses);
  FrameFit as_known;
  as_known.tool = known.tool.value_or(Isometry3d::Identity());
  as_known.root_to_base = known.base.value_or(Isometry3d::Identity()).inverse();
  note_worst(as_known, pairs, poses, model);
  if (known.tool && known.base && model.worst_m <= kModelLimitM) {
    model.outcome = kAgrees;
    return model;
  }
  const ControllerModel direct = model;
  const FrameFit fit = estimated_frames(pairs, as_known.tool);
  note_worst(fit, pairs, poses, model);
  // Two or three postures may leave the fit in a local minimum.
  const bool enough = poses.size() >= kFewestPostures;
  if (enough && model.worst_m > kModelLimitM) {
    model.outcome = kDiffers;
  } else if (enough && fit.determined) {
    model.outcome = compared_frames(fit, known, model);
  } else {
    model = direct;
    model.outcome = kUndecided;
    if (!known.tool || !known.base) model.worst_m = 0.0;
  }
  return model;
}

Phrase phrase(const ControllerModel& model, const Robot& robot) {
  using enum ControllerModel::Outcome;
  const std::vector<PhraseValue> values{{"mm", model.worst_m * kMmPerM},
                                        {"postures", model.postures},
                                        {"at", posture_words(robot, model.worst_rad)}};
  const Phrase over(model.postures == 1 ? "say.model.over_one" : "say.model.over", values);
  const Phrase agrees("say.model.agrees", {{"mm", model.worst_m * kMmPerM}, {"over", over}});
  switch (model.outcome) {
    case kNotStated: return "say.model.not_stated";
    case kAgrees: return agrees;
    case kOtherFrames: {
      Phrase frames = agrees;
      if (model.tool_off_m)
        frames = joined("say.join.semicolon", frames,
                        {"say.model.tool_off", {{"mm", *model.tool_off_m * kMmPerM}}});
      if (model.base_off_m)
        frames = joined("say.join.semicolon", frames,
                        {"say.model.base_off", {{"mm", *model.base_off_m * kMmPerM}}});
      return frames;
    }
    case kUndecided:
      if (model.worst_m > 0.0) return {"say.model.undecided", values};
      return {"say.model.too_few", {{"over", over}}};
    case kDiffers: break;
  }
  return sentence_phrase(*finding_of(model, robot));
}

std::optional<Finding> finding_of(const ControllerModel& model, const Robot& robot) {
  if (model.outcome != ControllerModel::Outcome::kDiffers) return std::nullopt;
  Finding finding{FindingKind::kControllerModel,
                  Severity::kWarns,
                  about_robot("", robot.name),
                  {in_mm("difference", model.worst_m), {"postures", model.postures}}};
  finding.text = posture_words(robot, model.worst_rad);
  return finding;
}

}  // namespace cellcal::calib
