#include "calib/result/unidentifiable.h"

#include <algorithm>
#include <cmath>

#include "calib/model/linear.h"
#include "calib/result/calibration.h"
#include "calib/result/finding_phrase.h"

namespace cellcal::calib {

namespace {

/// "A1.d, A2.a and 3 more"
Phrase list(const Cell& cell, const UnidentifiableDirection& d) {
  std::vector<Phrase> names;
  for (const ParameterKey& key : d.parameters) names.emplace_back(parameter_name(cell, key));
  if (d.more_parameters > 0)
    names.emplace_back("say.undetermined.more", std::vector<PhraseValue>{{"n", d.more_parameters}});
  Phrase all;
  for (std::size_t i = 0; i < names.size(); ++i)
    all = joined(i + 1 == names.size() ? "say.join.and" : "say.join.comma", all, names[i]);
  return all;
}

Phrase said(const char* id, const Cell& cell, const UnidentifiableDirection& d) {
  return {id, {{"list", list(cell, d)}}};
}

Phrase weak_phrase(const Cell& cell, const UnidentifiableDirection& d) {
  const bool alone = d.parameters.size() + d.more_parameters == 1;
  return joined(
      "say.join.sentences",
      said(alone ? "say.undetermined.alone" : "say.undetermined.together", cell, d),
      d.kind == UnidentifiableKind::kScale ? "say.undetermined.scale" : "say.undetermined.touch");
}

Phrase sentence(const Cell& cell, const UnidentifiableDirection& d) {
  switch (d.kind) {
    case UnidentifiableKind::kZeroOfFirstJoint:
      return {"say.undetermined.first_zero",
              {{"joint", cell.robot.joints.at(cell.robot.first_turning()).name}}};
    case UnidentifiableKind::kHeightOfBase:
      return {"say.undetermined.height",
              {{"parameter", parameter_name(cell, joint_parameter(ParameterKind::kD,
                                                                  cell.robot.first_turning()))}}};
    case UnidentifiableKind::kBehindLastJoint: return said("say.undetermined.behind_last", cell, d);
    case UnidentifiableKind::kNothingMoves: return said("say.undetermined.nothing_moves", cell, d);
    case UnidentifiableKind::kNoEffect: return said("say.undetermined.no_effect", cell, d);
    case UnidentifiableKind::kScale:
    case UnidentifiableKind::kWeak: return weak_phrase(cell, d);
    case UnidentifiableKind::kRecorded: return d.text;
  }
  return {};
}

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

Phrase phrase(const Cell& cell, const UnidentifiableDirection& d) {
  if (d.more_as_weak <= 0) return sentence(cell, d);
  return joined("say.join.sentences", sentence(cell, d),
                {"say.undetermined.as_weak", {{"n", d.more_as_weak}}});
}

std::string words(const Cell& cell, const UnidentifiableDirection& d) {
  return words(phrase(cell, d));
}

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
