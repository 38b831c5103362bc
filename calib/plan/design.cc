#include "calib/plan/design.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "calib/estimate/problem.h"
#include "calib/estimate/region.h"
#include "calib/estimate/solve.h"
#include "calib/model/linear.h"
#include "calib/model/long_work.h"
#include "calib/model/units.h"
#include "calib/result/level.h"

namespace cellcal::calib {

namespace {

/// Lower bound of 1 - h: 0 for a touch that alone constrains a direction.
constexpr double kLeast = 1e-12;

/// L with L L' = moves' moves; directions without effect on the relevant tips drop out of it.
Eigen::MatrixXd root_of(const Eigen::MatrixXd& moves_m) {
  if (moves_m.rows() <= moves_m.cols()) return moves_m.transpose();
  constexpr double kNothing = 1e-12;
  const Eigenpairs weight = eigenpairs(moves_m.transpose() * moves_m);
  const Eigen::VectorXd& values = weight.values;
  Eigen::Index none = 0;
  while (none < values.size() && values[none] <= kNothing * values.tail<1>()[0]) ++none;
  const Eigen::Index kept = values.size() - none;
  return weight.vectors.rightCols(kept) * values.tail(kept).cwiseSqrt().asDiagonal();
}

constexpr int kPoses = 200;
constexpr double kLimitMarginRad = 0.05;
/// Typical share of the compliance assumed if the file states none.
constexpr double kTypicalCompliance = 0.3;
/// Mean ripple left possible by the evidence after some tens of touches.
constexpr double kTypicalRippleRad = 5.0 * kRadPerArcsec;
/// A joint's function (calib/model/README.md, (2a)) as a few waves of no common period, alike at
/// neighbouring angles: it has 72 unknowns itself, for the same choice in eight times the time.
constexpr int kFunctionOrders[] = {6, 9, 14, 20, 29};
/// Prior of centres without one: a metre, in prior units, carries no information.
constexpr double kNoPriorWeight = 1e-2;

bool gives(const Cell& cell) {
  return std::any_of(cell.robot.joints.begin(), cell.robot.joints.end(),
                     [](const Joint& joint) { return joint.compliance_sigma_rad_per_nm > 0.0; });
}

/// Derivatives of the tips of the postures.
Eigen::MatrixXd moves(const ArmModel& arm, const std::vector<JointVector>& poses,
                      const Eigen::VectorXd& scale, const AccuracyRegion& region) {
  if (region.kind != AccuracyRegion::Kind::kTool) return aligned_moves(arm, poses, nullptr, scale);
  // Tip relative to the flange: independent of the base.
  Eigen::MatrixXd result = tip_moves(arm, poses, nullptr, scale).moves_m;
  for (int i = 0; i < arm.size(); ++i)
    if (const int joint = arm.parameters()[static_cast<std::size_t>(i)].joint;
        joint >= 0 && joint + 1 < arm.joint_count())
      result.col(i).setZero();
  return result;
}

std::vector<JointVector> postures(const Problem& problem, const std::vector<Candidate>& candidates,
                                  const AccuracyRegion& region) {
  std::vector<JointVector> touches;
  std::vector<Eigen::Vector3d> centres;
  for (const Candidate& c : candidates) touches.push_back(c.contact);
  for (const TargetBlock& block : problem.blocks())
    centres.push_back(
        carried_at(problem.cell().robot, std::vector<double>(static_cast<std::size_t>(
                                             problem.cell().targets[block.target].carried_by))) *
        problem.cell().targets[block.target].centre_m);
  return accuracy_region_postures(region, problem.arm(), touches, centres, kLimitMarginRad, kPoses);
}

/// The candidates' touches, and the targets' places.
struct Contacts {
  std::vector<Touch> touches;
  std::vector<TargetPlace> places = {};
};

Contacts contacts_of(const Cell& cell, const std::vector<Candidate>& candidates) {
  Contacts contacts{touches_of(cell, candidates)};
  for (const Target& target : cell.targets) {
    contacts.places.emplace_back(target.centre_m);
    if (target.kind != TargetKind::kPlane) continue;
    const Eigen::Vector3d across = target.normal.unitOrthogonal();
    contacts.places.back().axes << across, target.normal.cross(across), target.normal;
  }
  return contacts;
}

/// Derivatives of the tip at candidates of carried targets, in the frame of their axis, after
/// alignment: what a part on the positioner is worked with. Empty without any.
Eigen::MatrixXd moves_on_table(const Cell& cell, const ArmModel& arm,
                               const std::vector<Candidate>& candidates,
                               const Eigen::VectorXd& scale) {
  std::vector<const Candidate*> carried;
  for (const Candidate& c : candidates)
    if (cell.targets[c.target].carried_by > 0) carried.push_back(&c);
  const std::size_t count = std::min<std::size_t>(carried.size(), kPoses);
  constexpr std::size_t kEnough = 3;  // fix a rigid body
  if (count < kEnough) return Eigen::MatrixXd(0, 0);
  const auto pose = [&](std::size_t k) {
    const Candidate& c = *carried[k * carried.size() / count];
    const std::span<const double> angles(c.positioner_rad);
    const auto carriers = static_cast<std::size_t>(cell.targets[c.target].carried_by);
    return arm.prepare(c.contact, 0, nullptr, angles.first(carriers), angles.subspan(carriers));
  };
  return aligned(tip_moves(arm, count, pose, nullptr, scale));
}

Linearisation linearised(const Problem& problem) {
  return linearise(problem, Eigen::VectorXd::Zero(problem.size()),
                   std::vector<bool>(problem.touches().size(), true));
}

/// Adds the stated functions of the joints' angles, as waves of kFunctionOrders.
void add_functions(const Robot& stated, Cell cell, const Contacts& contacts,
                   const AccuracyRegion& region, DesignProblem& design) {
  for (std::size_t i = 0; i < stated.joints.size(); ++i) {
    Joint& joint = cell.robot.joints[i];
    joint.gear_ratio = 1.0;
    joint.harmonics = {std::begin(kFunctionOrders), std::end(kFunctionOrders)};
    joint.harmonic_falloff = 0.0;
    joint.harmonic_sigma_rad =
        stated.joints[i].function_sigma_rad / std::sqrt(std::size(kFunctionOrders));
  }
  const ArmModel arm(cell);
  const Problem problem(cell, arm, contacts.touches, contacts.places, kTypicalRippleRad);
  std::vector<int> waves;
  for (int i = 0; i < arm.size(); ++i)
    if (is_transmission(arm.parameters()[static_cast<std::size_t>(i)].kind)) waves.push_back(i);
  const auto count = static_cast<Eigen::Index>(waves.size());
  if (count == 0) return;
  const Eigen::Index before = design.arm->size(), behind = design.rows.cols() - before;
  const Linearisation at = linearised(problem);
  RowMajor rows(design.rows.rows(), before + count + behind);
  rows << design.rows.leftCols(before), at.jacobian(Eigen::seqN(0, rows.rows()), waves),
      design.rows.rightCols(behind);
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Identity(rows.cols(), rows.cols());
  std::vector<Eigen::Index> others(static_cast<std::size_t>(before + behind));
  std::iota(others.begin(), others.end(), 0);
  for (Eigen::Index& other : others)
    if (other >= before) other += count;
  covariance(others, others) = design.covariance_u;
  Eigen::MatrixXd all(design.moves_m.rows(), before + count);
  all << design.moves_m, moves(arm, design.postures, problem.scales(), region)(Eigen::all, waves);
  for (std::size_t k = 0; k < waves.size(); ++k)
    design.keys.insert(design.keys.begin() + before + static_cast<Eigen::Index>(k),
                       arm.parameters()[static_cast<std::size_t>(waves[k])]);
  Eigen::VectorXd weight = Eigen::VectorXd::Ones(rows.cols());
  weight(others) = design.prior_weight;
  design.prior_weight = std::move(weight);
  design.rows = std::move(rows);
  design.covariance_u = std::move(covariance);
  design.moves_m = std::move(all);
}

}  // namespace

Design::Design(RowMajor rows, Eigen::MatrixXd covariance_u, const Eigen::MatrixXd& moves_m)
    : rows_(std::move(rows)),
      covariance_(std::move(covariance_u)),
      in_(static_cast<std::size_t>(rows_.rows()), false) {
  const Eigen::MatrixXd root = root_of(moves_m);
  const Eigen::MatrixXd through = covariance_ * rows_.transpose();
  a_ = root.transpose() * through.topRows(moves_m.cols());
  h_ = rows_.cwiseProduct(through.transpose()).rowwise().sum();
  square_ = a_.colwise().squaredNorm();
}

double Design::gain(Eigen::Index candidate) const {
  return square_[candidate] / (1.0 + h_[candidate]);  // (67)
}

double Design::loss(Eigen::Index candidate) const {
  return square_[candidate] / std::max(kLeast, 1.0 - h_[candidate]);
}

Eigen::VectorXd Design::gains_without(Eigen::Index candidate) const {
  // Values after change(), from the products only.
  const double by = 1.0 / std::max(kLeast, 1.0 - h_[candidate]);
  with_ = rows_ * (covariance_ * rows_.row(candidate).transpose());
  with_of_ = candidate;
  const Eigen::VectorXd& with = with_;
  const Eigen::VectorXd dot = a_.transpose() * a_.col(candidate);
  const Eigen::ArrayXd step = by * with.array();
  return (square_.array() + 2.0 * step * dot.array() + square_[candidate] * step.square()) /
         (1.0 + h_.array() + step * with.array());
}

void Design::take(Eigen::Index candidate) {
  change(candidate, 1.0);
  in_[static_cast<std::size_t>(candidate)] = true;
}

void Design::take_all(const std::vector<std::size_t>& candidates) {
  // First their own rows, then all others in small groups that fit the cache.
  constexpr Eigen::Index kTogether = 48;
  const auto count = static_cast<Eigen::Index>(candidates.size());
  RowMajor rows(count, rows_.cols());
  Eigen::MatrixXd a(a_.rows(), count), s(rows_.cols(), count);
  Eigen::VectorXd h(count), by(count);
  for (Eigen::Index t = 0; t < count; ++t) {
    const auto own = static_cast<Eigen::Index>(candidates[static_cast<std::size_t>(t)]);
    rows.row(t) = rows_.row(own);
    a.col(t) = a_.col(own);
    h[t] = h_[own];
    in_[candidates[static_cast<std::size_t>(t)]] = true;
  }
  for (Eigen::Index t = 0; t < count; ++t) {
    poll_cancelled();
    s.col(t) = covariance_ * rows.row(t).transpose();
    by[t] = 1.0 / (1.0 + h[t]);
    const Eigen::Index behind = count - t - 1;
    covariance_.noalias() -= (by[t] * s.col(t)) * s.col(t).transpose();  // (68)
    if (behind == 0) break;
    const Eigen::VectorXd with = rows.bottomRows(behind + 1) * s.col(t);  // includes its own
    for (Eigen::Index c = 1; c <= behind; ++c) a.col(t + c) -= (by[t] * with[c]) * a.col(t);
    h.tail(behind) -= by[t] * with.tail(behind).cwiseAbs2();
  }
  Eigen::Index some = 0;
  for (Eigen::Index first = 0; first < rows_.rows(); first += some) {
    poll_cancelled();
    // Never leaves a single last row: Eigen sums its product in another order.
    const Eigen::Index left = rows_.rows() - first;
    some = left <= kTogether + 1 ? left : kTogether;
    for (Eigen::Index t = 0; t < count; ++t) {
      const Eigen::VectorXd with = rows_.middleRows(first, some) * s.col(t);
      for (Eigen::Index c = 0; c < some; ++c) a_.col(first + c) -= (by[t] * with[c]) * a.col(t);
      h_.segment(first, some) -= by[t] * with.cwiseAbs2();
    }
    for (Eigen::Index c = first; c < first + some; ++c) square_[c] = a_.col(c).squaredNorm();
  }
  with_of_ = -1;
}

void Design::drop(Eigen::Index candidate) {
  change(candidate, -1.0);
  in_[static_cast<std::size_t>(candidate)] = false;
}

void Design::change(Eigen::Index candidate, double sign) {
  const Eigen::VectorXd s = covariance_ * rows_.row(candidate).transpose();
  const double by = sign / (1.0 + sign * h_[candidate]);
  if (with_of_ != candidate) with_ = rows_ * s;
  with_of_ = -1;
  const Eigen::VectorXd& with = with_;
  const Eigen::VectorXd a = a_.col(candidate);
  covariance_.noalias() -= (by * s) * s.transpose();  // (68)
  for (Eigen::Index c = 0; c < a_.cols(); ++c) {
    auto own = a_.col(c);
    own -= (by * with[c]) * a;
    square_[c] = own.squaredNorm();
  }
  h_ -= by * with.cwiseAbs2();
}

Cell with_functions_of(const Robot& learnt, Cell cell) {
  for (Joint& to : cell.robot.joints) {
    const auto from = std::ranges::find(learnt.joints, to.name, &Joint::name);
    if (from == learnt.joints.end() || to.is_prismatic() || to.function_sigma_rad > 0.0) continue;
    to.function_sigma_rad = from->function_sigma_rad;
    to.function_reach_rad = from->function_reach_rad;
  }
  return cell;
}

DesignProblem design_problem(const Cell& stated, const std::vector<Candidate>& candidates,
                             const AccuracyRegion& region) {
  // Includes non-geometric errors: touches are chosen with the model of the verdict.
  Cell cell = at_level(stated, {gives(stated) ? 1.0 : kTypicalCompliance, 1.0, 0.0},
                       {});  // of the first tool
  for (Joint& joint : cell.robot.joints) {
    joint.function_sigma_rad = joint.function_fast_sigma_rad = 0.0;
    joint.waves.clear();
  }
  DesignProblem design;
  design.arm = std::make_shared<const ArmModel>(cell);
  const Contacts contacts = contacts_of(cell, candidates);
  const Problem problem(cell, *design.arm, contacts.touches, contacts.places, kTypicalRippleRad);
  const Linearisation rows = linearised(problem);
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(problem.size(), problem.size());
  design.prior_weight.resize(problem.size());
  for (int i = 0; i < problem.size(); ++i) {
    const Unknown& unknown = problem.unknowns()[static_cast<std::size_t>(i)];
    design.keys.push_back(unknown.key);
    design.prior_weight[i] = unknown.prior_weight;
    information(i, i) = std::pow(std::max(unknown.prior_weight, kNoPriorWeight), 2);
  }
  const auto lengths = rows.jacobian.bottomRows(rows.jacobian.rows() - rows.length_row);
  information += lengths.transpose() * lengths;
  design.rows = rows.jacobian.topRows(rows.length_row);
  design.covariance_u = Cholesky(information).inverse();
  design.scale = problem.scales().head(problem.arm_size());
  design.ripple_rad = region.kind == AccuracyRegion::Kind::kTool ? 0.0 : kTypicalRippleRad;
  design.postures = postures(problem, candidates, region);
  design.moves_m = moves(*design.arm, design.postures, design.scale, region);
  design.on_table_m = moves_on_table(cell, *design.arm, candidates, design.scale);
  add_functions(stated.robot, cell, contacts, region, design);
  return design;
}

}  // namespace cellcal::calib
