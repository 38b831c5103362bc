#include "calib/consistency/artefact_bias.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "calib/linear/cholesky.h"
#include "calib/model/units.h"

namespace cellcal::calib {

namespace {
/// Sigmas that contradict a size.
constexpr double kContradicted = 5.0;
/// However many touches there are, dirt and the way a target is pressed are not the same for all
/// targets: they have this much in common, in sigmas of one touch.
constexpr double kCommonSigma = 1.0 / 3.0;
/// A size that the others tell no better than this is not told.
constexpr double kUntoldM = 1e-3;

/// What the touches of a target, or of several, say of a size of theirs.
struct Said {
  double square = 0.0, pull = 0.0;  ///< a'a and a'r, a what a size of one metre more does
  Eigen::VectorXd by_all;           ///< J'a
  double sigma_m = 0.0;             ///< of one touch, summed
  int touches = 0;

  Eigen::VectorXd rows;  ///< a, where the touches' errors go together

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
    pull += a * linear.residual[row];
    by_all.noalias() += a * linear.jacobian.row(row).transpose();
  }

  void finish(const Posterior& posterior) {
    if (touches == 0 || rows.size() == 0) return;
    posterior.together.triangularView<Eigen::Lower>().solveInPlace(rows);
    square = rows.squaredNorm();
    pull = rows.dot(posterior.linear.residual.head(rows.size()));
    by_all = posterior.linear.jacobian.topRows(rows.size()).transpose() * rows;
  }
};

}  // namespace

std::vector<SizeResult> artefact_biases(const Problem& problem, const Estimate& e,
                                        const NormalEquations& touches, double chi2, double dof) {
  std::vector<Said> said(problem.blocks().size());
  Said wires;
  int count_of_wires = 0;
  const Linearisation& linear = e.posterior.linear;
  for (const auto& [touch, row] : linear.touch_row) {
    const auto block = static_cast<std::size_t>(problem.block_of(touch));
    const TargetKind kind = problem.cell().targets[problem.blocks()[block].target].kind;
    if (kind != TargetKind::kSphere && kind != TargetKind::kWire) continue;
    if (kind == TargetKind::kWire && said[block].touches == 0) ++count_of_wires;
    for (Said* own : {&said[block], kind == TargetKind::kWire ? &wires : nullptr})
      if (own != nullptr) own->add(problem, e.posterior, touch, row);
  }
  for (Said& own : said) own.finish(e.posterior);
  wires.finish(e.posterior);
  NormalEquations all = touches;
  for (Eigen::Index row = linear.length_row; row < linear.jacobian.rows(); ++row) {
    const auto by = linear.jacobian.row(row);
    all.information.selfadjointView<Eigen::Lower>().rankUpdate(by.transpose());
    all.gradient += linear.residual[row] * by.transpose();
  }
  const Cholesky factor(all.information);
  if (!factor.positive()) return {};
  std::vector<SizeResult> sizes;
  const auto ask = [&](const Said& own, const std::string& target) {
    const Eigen::VectorXd reached = factor.solve(own.by_all);
    const double information = own.square - own.by_all.dot(reached);
    if (!(information > 0.0)) return;
    SizeResult size;
    size.target = target;
    size.off_m = (own.pull - reached.dot(all.gradient)) / information;  // (48)
    // Scatter beyond what is stated widens, but not the scatter that this size itself makes.
    const double inflation =  // (45)
        std::max(1.0, (chi2 - size.off_m * size.off_m * information) / std::max(1.0, dof - 1.0));
    const double common_m =
        kCommonSigma * std::max(problem.cell().touch_sigma_m, own.sigma_m / own.touches);
    size.sigma_m = std::hypot(std::sqrt(inflation / information), common_m);  // (49)
    if (size.sigma_m < kUntoldM) sizes.push_back(std::move(size));
  };
  for (std::size_t b = 0; b < said.size(); ++b)
    if (said[b].touches > 0) ask(said[b], problem.cell().targets[problem.blocks()[b].target].id);
  if (count_of_wires > 1) ask(wires, {});
  return sizes;
}

double contradiction(const SizeResult& size) { return std::abs(size.off_m) / size.sigma_m; }

const SizeResult* worst_contradicted(const std::vector<SizeResult>& sizes) {
  const auto worst = std::max_element(
      sizes.begin(), sizes.end(),
      [](const SizeResult& a, const SizeResult& b) { return contradiction(a) < contradiction(b); });
  return worst != sizes.end() && contradiction(*worst) > kContradicted ? &*worst : nullptr;
}

PutRight put_right(const Cell& cell, const std::vector<Touch>& touches, const SizeResult& size) {
  PutRight right{cell, touches};
  if (is_of_sphere(cell, size)) {
    right.cell.targets[cell.target_index(size.target)].diameter_m += 2.0 * size.off_m;
    return right;
  }
  for (Touch& touch : right.touches)
    if (size.target.empty()
            ? cell.targets[cell.target_index(touch.target)].kind == TargetKind::kWire
            : touch.target == size.target)
      touch.radius_m += size.off_m;
  return right;
}

bool is_of_sphere(const Cell& cell, const SizeResult& size) {
  return !size.target.empty() &&
         cell.targets[cell.target_index(size.target)].kind == TargetKind::kSphere;
}

std::string size_words(const Cell& cell, const SizeResult& size) {
  if (is_of_sphere(cell, size)) {
    const Target& target = cell.targets[cell.target_index(size.target)];
    return fmt::format("the diameter of {} {:.2f} +- {:.2f} mm instead of {:.3f} mm", size.target,
                       (target.diameter_m + 2.0 * size.off_m) * kMmPerM,
                       2.0 * size.sigma_m * kMmPerM, target.diameter_m * kMmPerM);
  }
  return fmt::format("all readings of {} {:+.2f} +- {:.2f} mm longer",
                     size.target.empty() ? "all wires" : size.target, size.off_m * kMmPerM,
                     size.sigma_m * kMmPerM);
}

}  // namespace cellcal::calib
