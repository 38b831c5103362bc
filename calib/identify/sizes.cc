#include "calib/identify/sizes.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace cellcal::calib {

namespace {

constexpr double kMmPerM = 1000.0;
/// Sigmas that contradict a size.
constexpr double kContradicted = 5.0;
/// However many touches there are, dirt and the way a target is pressed are not the same for all
/// targets: they have this much in common, in sigmas of one touch.
constexpr double kCommonSigma = 1.0 / 3.0;
/// A size that the others tell no better than this is not told.
constexpr double kUntoldM = 1e-3;

}  // namespace

std::vector<SizeResult> sizes_by_others(const Problem& problem, const Estimate& e,
                                        const Others& touches, double chi2_per_dof) {
  struct Said {
    double square = 0.0, pull = 0.0;  ///< a'a and a'r, a what a size of one metre more does
    Eigen::VectorXd by_all;           ///< J'a
    double sigma_m = 0.0;             ///< of one touch
    int touches = 0;
  };
  std::vector<Said> said(problem.blocks().size());
  const Linearisation& linear = e.posterior.linear;
  for (const auto& [touch, row] : linear.touch_row) {
    const auto block = static_cast<std::size_t>(problem.block_of(touch));
    const TargetKind kind = problem.cell().targets[problem.blocks()[block].target].kind;
    if (kind != TargetKind::kSphere && kind != TargetKind::kWire) continue;
    Said& own = said[block];
    if (own.touches++ == 0) own.by_all = Eigen::VectorXd::Zero(problem.size());
    const double a = 1.0 / problem.sigma_m(touch);
    own.square += a * a;
    own.pull += a * linear.residual[row];
    own.by_all.noalias() += a * linear.jacobian.row(row).transpose();
    own.sigma_m += problem.own_sigma_m(touch);
  }
  Others all = touches;
  for (Eigen::Index row = linear.length_row; row < linear.jacobian.rows(); ++row) {
    const auto by = linear.jacobian.row(row);
    all.information.selfadjointView<Eigen::Lower>().rankUpdate(by.transpose());
    all.pull += linear.residual[row] * by.transpose();
  }
  const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> factor(all.information);
  if (factor.info() != Eigen::Success) return {};
  const double inflation = std::max(1.0, chi2_per_dof);
  std::vector<SizeResult> sizes;
  for (std::size_t b = 0; b < said.size(); ++b) {
    const Said& own = said[b];
    if (own.touches == 0) continue;
    const Eigen::VectorXd reached = factor.solve(own.by_all);
    const double information = own.square - own.by_all.dot(reached);
    if (!(information > 0.0)) continue;
    SizeResult size;
    size.target = problem.cell().targets[problem.blocks()[b].target].id;
    size.off_m = (own.pull - reached.dot(all.pull)) / information;
    size.sigma_m =
        std::hypot(std::sqrt(inflation / information), kCommonSigma * own.sigma_m / own.touches);
    if (size.sigma_m < kUntoldM) sizes.push_back(std::move(size));
  }
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
  Target& target = right.cell.targets[cell.target_index(size.target)];
  if (target.kind == TargetKind::kSphere) {
    target.diameter_m += 2.0 * size.off_m;
    return right;
  }
  for (Touch& touch : right.touches)
    if (touch.target == size.target) touch.radius_m += size.off_m;
  return right;
}

std::string size_words(const Cell& cell, const SizeResult& size) {
  const Target& target = cell.targets[cell.target_index(size.target)];
  if (target.kind == TargetKind::kSphere)
    return fmt::format("the diameter of {} {:.2f} +- {:.2f} mm instead of {:.3f} mm", size.target,
                       (target.diameter_m + 2.0 * size.off_m) * kMmPerM,
                       2.0 * size.sigma_m * kMmPerM, target.diameter_m * kMmPerM);
  return fmt::format("all readings of {} {:+.2f} +- {:.2f} mm longer", size.target,
                     size.off_m * kMmPerM, size.sigma_m * kMmPerM);
}

}  // namespace cellcal::calib
