#include "calib/consistency/certified_lengths.h"

#include <algorithm>
#include <cmath>

#include "calib/linear/cholesky.h"

namespace cellcal::calib {

namespace {

/// Sigmas of both that contradict a length.
constexpr double kLengthContradicted = 5.0;

}  // namespace

std::vector<LengthResult> leave_one_out_lengths(const Problem& problem, const Estimate& e,
                                                const NormalEquations& touches, double chi2,
                                                double dof) {
  std::vector<LengthResult> results;
  const auto& lengths = problem.lengths();
  if (lengths.empty()) return results;
  const Linearisation& linear = e.posterior.linear;
  const auto row = [&](std::size_t k) { return linear.length_row + static_cast<Eigen::Index>(k); };
  const auto same_blocks = [&](std::size_t a, std::size_t b) {
    return std::minmax(lengths[a].block_a, lengths[a].block_b) ==
           std::minmax(lengths[b].block_a, lengths[b].block_b);
  };
  for (std::size_t k = 0; k < lengths.size(); ++k) {
    // All but what is said of these two ends. Summed up anew: taken away again, a length that is
    // certified to next to nothing would leave rounding only.
    Eigen::MatrixXd information = touches.information;
    Eigen::VectorXd gradient = touches.gradient;
    for (std::size_t l = 0; l < lengths.size(); ++l) {
      if (same_blocks(k, l)) continue;
      const auto by = linear.jacobian.row(row(l));
      information.selfadjointView<Eigen::Lower>().rankUpdate(by.transpose());
      gradient += linear.residual[row(l)] * by.transpose();
    }
    const Cholesky factor(information);
    if (!factor.positive()) continue;
    const Eigen::VectorXd by = linear.jacobian.row(row(k)).transpose();
    const Eigen::VectorXd reached = factor.solve(by);
    const double sigma_m = lengths[k].sigma_m, variance = by.dot(reached);  // in its own sigma^2
    const double off = linear.residual[row(k)] - reached.dot(gradient);  // (46), in its own sigma
    // Scatter beyond what is stated widens, but not the scatter that this length itself makes.
    const double squared = off * off / (1.0 + variance);  // (45)
    const double inflation = std::max(1.0, (chi2 - squared) / std::max(1.0, dof - 1.0));
    LengthResult result;
    result.from = problem.cell().targets[problem.blocks()[lengths[k].block_a].target].id;
    result.to = problem.cell().targets[problem.blocks()[lengths[k].block_b].target].id;
    result.certified_m = lengths[k].length_m;
    result.certified_sigma_m = sigma_m;
    result.by_others_m = lengths[k].length_m + off * sigma_m;
    result.sigma_m = std::sqrt(inflation * variance) * sigma_m;
    results.push_back(std::move(result));
  }
  return results;
}

double contradiction(const LengthResult& length) {  // (47)
  return std::abs(length.by_others_m - length.certified_m) /
         std::hypot(length.sigma_m, length.certified_sigma_m);
}

bool is_contradicted(const LengthResult& length) {
  return contradiction(length) > kLengthContradicted;
}

double least_seen_error_m(const LengthResult& length) {
  return kLengthContradicted * std::hypot(length.sigma_m, length.certified_sigma_m);
}

bool same_ends(const LengthResult& a, const LengthResult& b) {
  return std::minmax(a.from, a.to) == std::minmax(b.from, b.to);
}

const LengthResult* worst_contradicted(const std::vector<LengthResult>& lengths) {
  const auto worst = std::max_element(lengths.begin(), lengths.end(),
                                      [](const LengthResult& a, const LengthResult& b) {
                                        return contradiction(a) < contradiction(b);
                                      });
  return worst != lengths.end() && is_contradicted(*worst) ? &*worst : nullptr;
}

bool same_ends(const CertifiedLength& a, const CertifiedLength& b) {
  return (a.from == b.from && a.to == b.to) || (a.from == b.to && a.to == b.from);
}

bool is_of(const LengthResult& result, const CertifiedLength& length) {
  return result.from == length.from && result.to == length.to &&
         result.certified_m == length.length_m;
}

Cell silenced(Cell cell, const std::function<bool(const CertifiedLength&)>& which) {
  constexpr double kAnyLengthM = 10.0;
  for (CertifiedLength& length : cell.lengths)
    if (!which || which(length)) length.sigma_m = kAnyLengthM;
  return cell;
}

}  // namespace cellcal::calib
