#include "calib/verdict/artefacts.h"

#include <algorithm>
#include <cmath>

#include "calib/estimate/parallel.h"
#include "calib/model/linear.h"
#include "calib/model/product.h"

namespace cellcal::calib {

namespace {

/// Sigmas of both by which a stated size or length is contradicted.
constexpr double kContradicted = 5.0;
/// Dirt and the way of pressing differ between targets, regardless of the number of touches:
/// minimum sigma of a common error, in sigmas of one touch.
constexpr double kCommonSigma = 1.0 / 3.0;
/// A bias with a larger sigma is not reported.
constexpr double kUndeterminedM = 1e-3;

/// Column of a bias common to the touches of one target, or of several.
struct BiasColumn {
  double square = 0.0, gradient = 0.0;  ///< j_b'j_b and j_b'r; j_b: by a bias of one metre
  Eigen::VectorXd by_all;               ///< J'j_b
  double sigma_m = 0.0;                 ///< of one touch, summed
  int touches = 0;

  Eigen::VectorXd rows;  ///< j_b, if the touches' errors are correlated

  void add(const Problem& problem, const Posterior& posterior, std::size_t touch, int row) {
    const Linearisation& linear = posterior.linear;
    const double a = 1.0 / problem.sigma_m(touch);
    if (touches++ == 0) {
      by_all = Eigen::VectorXd::Zero(problem.size());
      rows = Eigen::VectorXd::Zero(posterior.together.rows());
    }
    sigma_m += problem.own_sigma_m(touch);
    if (rows.size() > 0) {
      rows[row] = a;
      return;
    }
    square += a * a;
    gradient += a * linear.residual[row];
    by_all.noalias() += a * linear.jacobian.row(row).transpose();
  }

  void finish(const Posterior& posterior) {
    if (touches == 0 || rows.size() == 0) return;
    posterior.together.triangularView<Eigen::Lower>().solveInPlace(rows);
    square = rows.squaredNorm();
    gradient = rows.dot(posterior.linear.residual.head(rows.size()));
    by_all = posterior.linear.jacobian.topRows(rows.size()).transpose() * rows;
  }
};

/// Adds one row of the linearisation.
void add_row(const Linearisation& linear, Eigen::Index row, NormalEquations& all) {
  const auto by = linear.jacobian.row(row);
  all.information.selfadjointView<Eigen::Lower>().rankUpdate(by.transpose());
  all.gradient += linear.residual[row] * by.transpose();
}

/// J'J, its lower triangle.
Eigen::MatrixXd lower_gram(const Eigen::Ref<const RowMajor>& j) {
  const auto count = static_cast<std::size_t>(j.rows());
  std::vector<Eigen::MatrixXd> sums(parts_of(count), Eigen::MatrixXd::Zero(j.cols(), j.cols()));
  by_parts(count, [&](std::size_t part, std::size_t begin, std::size_t behind) {
    constexpr Eigen::Index kRows = 128;  // stays in the cache
    const auto end = static_cast<Eigen::Index>(behind);
    for (auto first = static_cast<Eigen::Index>(begin); first < end; first += kRows)
      add_square(1.0, j.middleRows(first, std::min(kRows, end - first)).transpose(), sums[part]);
  });
  for (std::size_t part = 1; part < sums.size(); ++part) sums[0] += sums[part];
  return std::move(sums[0]);
}

template <class Stated>
const Stated* worst_of(const std::vector<Stated>& all) {
  const auto worst =
      std::ranges::max_element(all, {}, [](const Stated& one) { return contradiction(one); });
  return worst != all.end() && contradiction(*worst) > kContradicted ? &*worst : nullptr;
}

/// Leverage below which at most this share of the gate passes into the fit, and less into the tip.
constexpr double kHeldByItself = 0.5;
/// Leverages are means over the levels, and may slightly exceed one.
constexpr double kLeastUnheld = 1e-6;
/// A larger error is a contact too early, or none: the search ends with that failure.
constexpr double kLargestErrorM = 3e-3;
/// Sufficient for a mean.
constexpr Eigen::Index kRowsOfPoses = 3 * 60;

}  // namespace

std::vector<ArtefactBias> artefact_biases(const Problem& problem, const Estimate& e,
                                          const NormalEquations& touches, double chi2, double dof) {
  std::vector<BiasColumn> columns(problem.blocks().size());
  BiasColumn wires;
  int count_of_wires = 0;
  const Linearisation& linear = e.posterior.linear;
  for (const auto& [touch, row] : linear.touch_row) {
    const auto block = static_cast<std::size_t>(problem.block_of(touch));
    const TargetKind kind = problem.cell().targets[problem.blocks()[block].target].kind;
    if (kind != TargetKind::kSphere && kind != TargetKind::kWire) continue;
    if (kind == TargetKind::kWire && columns[block].touches == 0) ++count_of_wires;
    for (BiasColumn* own : {&columns[block], kind == TargetKind::kWire ? &wires : nullptr})
      if (own != nullptr) own->add(problem, e.posterior, touch, row);
  }
  for (BiasColumn& own : columns) own.finish(e.posterior);
  wires.finish(e.posterior);
  NormalEquations all = touches;
  for (Eigen::Index row = linear.length_row; row < linear.jacobian.rows(); ++row)
    add_row(linear, row, all);
  const Cholesky factor(all.information);
  if (!factor.positive()) return {};
  std::vector<ArtefactBias> biases;
  const auto ask = [&](const BiasColumn& own, const std::string& target) {
    const Eigen::VectorXd reached = factor.solve(own.by_all);
    const double information = own.square - own.by_all.dot(reached);
    if (!(information > 0.0)) return;
    ArtefactBias bias;
    bias.target = target;
    bias.off_m = (own.gradient - reached.dot(all.gradient)) / information;  // (48)
    // Excess scatter widens the result, except the part caused by this bias.
    const double inflation =  // (45)
        std::max(1.0, (chi2 - bias.off_m * bias.off_m * information) / std::max(1.0, dof - 1.0));
    const double common_m =
        kCommonSigma * std::max(problem.cell().touch_sigma_m, own.sigma_m / own.touches);
    bias.sigma_m = std::hypot(std::sqrt(inflation / information), common_m);  // (49)
    if (bias.sigma_m < kUndeterminedM) biases.push_back(std::move(bias));
  };
  for (std::size_t b = 0; b < columns.size(); ++b)
    if (columns[b].touches > 0)
      ask(columns[b], problem.cell().targets[problem.blocks()[b].target].id);
  if (count_of_wires > 1) ask(wires, {});
  return biases;
}

double contradiction(const ArtefactBias& bias) { return std::abs(bias.off_m) / bias.sigma_m; }

const ArtefactBias* worst_contradicted(const std::vector<ArtefactBias>& biases) {
  return worst_of(biases);
}

PutRight put_right(const Cell& cell, const std::vector<Touch>& touches, const ArtefactBias& bias) {
  PutRight right{cell, touches};
  if (is_of_sphere(cell, bias)) {
    right.cell.targets[cell.target_index(bias.target)].diameter_m += 2.0 * bias.off_m;
    return right;
  }
  for (Touch& touch : right.touches)
    if (bias.target.empty()
            ? cell.targets[cell.target_index(touch.target)].kind == TargetKind::kWire
            : touch.target == bias.target)
      touch.radius_m += bias.off_m;
  return right;
}

bool is_of_sphere(const Cell& cell, const ArtefactBias& bias) {
  return !bias.target.empty() &&
         cell.targets[cell.target_index(bias.target)].kind == TargetKind::kSphere;
}

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
    // All information except that on these two ends. Summed up anew: subtracting a length that is
    // certified almost exactly would leave rounding only.
    NormalEquations others = touches;
    for (std::size_t l = 0; l < lengths.size(); ++l)
      if (l != k && (lengths[k].is_check || !same_blocks(k, l))) add_row(linear, row(l), others);
    const Cholesky factor(others.information);
    if (!factor.positive()) continue;
    const Eigen::VectorXd by = linear.jacobian.row(row(k)).transpose();
    const Eigen::VectorXd reached = factor.solve(by);
    // In the squared sigma of its row.
    const double row_m = lengths[k].fit_sigma_m(), variance = by.dot(reached);
    const double off =
        linear.residual[row(k)] - reached.dot(others.gradient);  // (46), in its own sigma
    // Excess scatter widens the result, except the part caused by this length.
    const double squared = off * off / (1.0 + variance);  // (45)
    const double inflation = std::max(1.0, (chi2 - squared) / std::max(1.0, dof - 1.0));
    LengthResult result;
    result.from = problem.cell().targets[problem.blocks()[lengths[k].block_a].target].id;
    result.to = problem.cell().targets[problem.blocks()[lengths[k].block_b].target].id;
    result.certified_m = lengths[k].length_m;
    result.certified_sigma_m = lengths[k].sigma_m;
    result.is_check = lengths[k].is_check;
    result.by_others_m = lengths[k].length_m + off * row_m;
    result.sigma_m = std::sqrt(inflation * variance) * row_m;
    results.push_back(std::move(result));
  }
  return results;
}

double contradiction(const LengthResult& length) {  // (47)
  return std::abs(length.by_others_m - length.certified_m) /
         std::hypot(length.sigma_m, length.certified_sigma_m);
}

bool is_contradicted(const LengthResult& length) { return contradiction(length) > kContradicted; }

double least_seen_error_m(const LengthResult& length) {
  return kContradicted * std::hypot(length.sigma_m, length.certified_sigma_m);
}

bool same_ends(const LengthResult& a, const LengthResult& b) {
  return std::minmax(a.from, a.to) == std::minmax(b.from, b.to);
}

const LengthResult* worst_contradicted(const std::vector<LengthResult>& lengths) {
  return worst_of(lengths);
}

bool same_ends(const CertifiedLength& a, const CertifiedLength& b) {
  return std::minmax(a.from, a.to) == std::minmax(b.from, b.to);
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

NormalEquations normal_equations_without_lengths(const Problem& problem, const Estimate& e) {
  constexpr double kFlat = 1e-8, kHair = 1.0 + 1e-12, kWider = 2.0;
  const Linearisation& linear = e.posterior.linear;
  const auto touched = linear.jacobian.topRows(linear.length_row);
  NormalEquations all{lower_gram(touched),
                      touched.transpose() * linear.residual.head(linear.length_row)};
  for (int i = 0; i < problem.size(); ++i) {
    const Unknown& unknown = problem.unknowns()[i];
    const double weight = unknown.prior_weight / (i < problem.arm_size() ? kWider : 1.0);
    const double prior = std::max(kFlat, weight * weight);
    all.gradient[i] += prior * (e.u[i] - unknown.prior_mean_u);  // (44)
    all.information(i, i) = kHair * (all.information(i, i) + prior);
  }
  return all;
}

UncheckedTouch least_checked_touch(const Problem& problem, const Estimate& e,
                                   const Eigen::Ref<const Eigen::MatrixXd>& moves) {
  UncheckedTouch worst;
  const auto some = moves.topRows(std::min(kRowsOfPoses, moves.rows()));
  for (const auto& [touch, row] : e.posterior.linear.touch_row)
    for (int k = row; k < row + problem.place_rows(touch); ++k) {
      if (!(e.posterior.leverage[k] > kHeldByItself)) continue;
      const double free = std::max(1.0 - e.posterior.leverage[k], kLeastUnheld);
      // (99): within the gate |r| / sqrt(free), of which r = free unseen / sigma.
      const double sigma_m = problem.sigma_m(touch),
                   unseen_m = std::min(e.gate / std::sqrt(free) * sigma_m, kLargestErrorM);
      const Eigen::VectorXd response_u = e.posterior.covariance_u.topRows(moves.cols()) *
                                         e.posterior.linear.jacobian.row(k).transpose();
      const Eigen::VectorXd shifts = some * response_u;
      double sum = 0.0;
      for (Eigen::Index i = 0; i < shifts.size(); i += 3) sum += shifts.segment<3>(i).norm();
      const double shift_m = unseen_m / sigma_m * sum / (static_cast<double>(shifts.size()) / 3.0);
      if (shift_m > worst.shift_m) worst = {touch, unseen_m, shift_m};
    }
  return worst;
}

}  // namespace cellcal::calib
