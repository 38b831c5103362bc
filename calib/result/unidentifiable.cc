#include "calib/result/unidentifiable.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "calib/model/linear.h"
#include "calib/result/calibration.h"

namespace cellcal::calib {

namespace {

constexpr std::array kUnidentifiableNames = {
    std::pair{UnidentifiableKind::kZeroOfFirstJoint, "zero_of_first_joint"},
    std::pair{UnidentifiableKind::kHeightOfBase, "height_of_base"},
    std::pair{UnidentifiableKind::kBehindLastJoint, "behind_last_joint"},
    std::pair{UnidentifiableKind::kNothingMoves, "nothing_moves"},
    std::pair{UnidentifiableKind::kNoEffect, "no_effect"},
    std::pair{UnidentifiableKind::kScale, "scale"},
    std::pair{UnidentifiableKind::kWeak, "weak"},
    std::pair{UnidentifiableKind::kRecorded, "recorded"},
};

/// "A1.d, A2.a and 3 more"
std::string list(const Cell& cell, const UnidentifiableDirection& d) {
  std::vector<std::string> names;
  for (const ParameterKey& key : d.parameters) names.push_back(parameter_name(cell, key));
  if (d.more_parameters > 0) names.push_back(std::to_string(d.more_parameters) + " more");
  std::string text;
  for (std::size_t i = 0; i < names.size(); ++i)
    text += (i == 0 ? "" : i + 1 == names.size() ? " and " : ", ") + names[i];
  return text;
}

std::string weak_words(const Cell& cell, const UnidentifiableDirection& d) {
  const bool alone = d.parameters.size() + d.more_parameters == 1;
  return list(cell, d) +
         (alone ? " is not determined by these touches; its tolerance decides"
                : " cannot be separated by these touches; their tolerances decide") +
         (d.kind == UnidentifiableKind::kScale
              ? ". All lengths scale together: touch a second sphere at a certified distance"
              : ". Touch in other postures");
}

std::string sentence(const Cell& cell, const UnidentifiableDirection& d) {
  switch (d.kind) {
    case UnidentifiableKind::kZeroOfFirstJoint:
      return "zero of " + cell.robot.joints.at(cell.robot.first_turning()).name +
             ": the same as turning all targets about the base axis. Fixed by convention (gauge)";
    case UnidentifiableKind::kHeightOfBase:
      return "height of the arm on its base (" +
             parameter_name(cell, joint_parameter(ParameterKind::kD, cell.robot.first_turning())) +
             "): the same as lowering all targets. Fixed by convention (gauge)";
    case UnidentifiableKind::kBehindLastJoint:
      return list(cell, d) +
             " move the tip in three directions only, behind the last axis: one combination is not "
             "observable. Fixed by convention (gauge)";
    case UnidentifiableKind::kNothingMoves:
      return list(cell, d) +
             " can change together without moving anything. Fixed by convention (gauge)";
    case UnidentifiableKind::kNoEffect:
      return list(cell, d) +
             " moves the tip by less than 0.001 mm: not observable, and without effect; its "
             "tolerance decides";
    case UnidentifiableKind::kScale:
    case UnidentifiableKind::kWeak:
      return weak_words(cell, d);
    case UnidentifiableKind::kRecorded:
      return d.text;
  }
  return {};
}

}  // namespace

const char* to_string(UnidentifiableKind kind) {
  for (const auto& [one, name] : kUnidentifiableNames)
    if (one == kind) return name;
  return "";
}

std::optional<UnidentifiableKind> unidentifiable_kind(const std::string& name) {
  for (const auto& [kind, its] : kUnidentifiableNames)
    if (name == its) return kind;
  return std::nullopt;
}

std::string words(const Cell& cell, const UnidentifiableDirection& d) {
  std::string text = sentence(cell, d);
  if (d.more_as_weak > 0)
    text += ". " + std::to_string(d.more_as_weak) + " further directions are as weak";
  return text;
}

namespace {

// Threshold on the variance ratio with the frame held fixed. A parameter below it was determined by
// the frame only, such as the height of the base: the remainder is a trace of the targets' heights,
// weighted by the squared ratio of the tolerances (0.7 mm against 10 mm leave 2e-6), with
// meaningless correlations. A target known to 0.003 mm in a frame known to 0.7 mm keeps 2e-5.
constexpr double kNothingLeft = 1e-5;

// Correlation matrix conditional on the frame coordinates:
//   S_g = S_1 - F (F' S_1^-1 F)^-1 F',  S_1 the covariance scaled to unit diagonal.
// Returns false if S_1 is not positive definite in double precision.
bool remove_frame(Eigen::MatrixXd& scaled, const Eigen::MatrixXd& basis) {
  const Cholesky factor(scaled);
  if (!factor.positive()) return false;
  const Eigen::MatrixXd whitened = factor.whitened(basis);
  const Cholesky inner(whitened.transpose() * whitened);
  if (!inner.positive()) return false;
  const Eigen::MatrixXd reduced =
      scaled - basis * inner.solve(Eigen::MatrixXd(basis.transpose()));  // (11)
  if (!reduced.allFinite()) return false;
  scaled = reduced;
  return true;
}

}  // namespace

Correlations strong_correlations(const Calibration& calibration, double least) {
  Correlations result;
  const auto count = static_cast<Eigen::Index>(calibration.parameters.size());
  const Eigen::MatrixXd& covariance = calibration.covariance;
  if (count == 0 || covariance.rows() != count || covariance.cols() != count ||
      !covariance.allFinite()) {
    return result;
  }
  result.available = true;

  // Parameters without variance are fixed and have no correlations.
  std::vector<Eigen::Index> free;
  for (Eigen::Index i = 0; i < count; ++i) {
    if (covariance(i, i) > 0.0) free.push_back(i);
  }
  const auto size = static_cast<Eigen::Index>(free.size());
  Eigen::VectorXd scale(size);
  for (Eigen::Index i = 0; i < size; ++i) scale[i] = 1.0 / std::sqrt(covariance(free[i], free[i]));
  Eigen::MatrixXd scaled(size, size);
  for (Eigen::Index i = 0; i < size; ++i) {
    for (Eigen::Index j = 0; j < size; ++j) {
      scaled(i, j) = covariance(free[i], free[j]) * scale[i] * scale[j];
    }
  }
  const Eigen::MatrixXd& basis = calibration.frame_basis;
  if (basis.rows() == count && basis.cols() > 0 && basis.allFinite()) {
    Eigen::MatrixXd scaled_basis(size, basis.cols());
    for (Eigen::Index i = 0; i < size; ++i) scaled_basis.row(i) = basis.row(free[i]) * scale[i];
    result.frame_removed = remove_frame(scaled, scaled_basis);
  }
  std::vector<bool> uninformative;
  for (const ParameterResult& p : calibration.parameters)
    uninformative.push_back(p.decided_by == DecidedBy::kFrame || p.key.target >= 0);
  for (Eigen::Index i = 0; i < size; ++i) {
    for (Eigen::Index j = i + 1; j < size; ++j) {
      if (std::min(scaled(i, i), scaled(j, j)) <= kNothingLeft) continue;
      const double correlation = scaled(i, j) / std::sqrt(scaled(i, i) * scaled(j, j));
      if (!std::isfinite(correlation) || std::abs(correlation) < least) continue;
      const auto first = static_cast<std::size_t>(free[i]);
      const auto second = static_cast<std::size_t>(free[j]);
      if (uninformative[first] || uninformative[second])
        ++result.of_targets_or_frame;
      else
        result.pairs.push_back({first, second, std::clamp(correlation, -1.0, 1.0)});
    }
  }
  std::stable_sort(result.pairs.begin(), result.pairs.end(),
                   [](const CorrelatedPair& one, const CorrelatedPair& other) {
                     return std::abs(one.correlation) > std::abs(other.correlation);
                   });
  return result;
}

}  // namespace cellcal::calib
