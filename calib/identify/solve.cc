#include "calib/identify/solve.h"

#include <ceres/ceres.h>

#include <algorithm>
#include <cmath>

#include "calib/files/error.h"

namespace cellcal::calib {

namespace {

int count_rows(const Problem& problem, const std::vector<bool>& use) {
  int rows = static_cast<int>(problem.lengths().size());
  for (std::size_t i = 0; i < problem.touches().size(); ++i)
    if (use[i]) rows += problem.rows(i);
  return rows;
}

/// Whitened residuals of touches and lengths, and their derivatives by u, in one sweep. Owns its
/// work space: evaluating allocates nothing.
class Rows {
 public:
  Rows(const Problem& problem, const std::vector<bool>& use, double sigma_floor_m = 0.0)
      : problem_(problem),
        use_(use),
        floor_m_(sigma_floor_m),
        count_(count_rows(problem, use)),
        x_(problem.size()),
        by_shared_(3 * problem.shared_size()) {}

  int count() const { return count_; }

  /// `j`: row-major, count() x size(), zeroed by the caller outside of what a row touches; null
  /// where not wanted.
  void evaluate(const double* u, double* r, double* j) {
    for (int i = 0; i < problem_.size(); ++i) {
      const Unknown& unknown = problem_.unknowns()[i];
      x_[i] = unknown.origin + unknown.scale * u[i];
    }
    int row = 0;
    for (std::size_t i = 0; i < problem_.touches().size(); ++i)
      if (use_[i]) row += touch(i, r + row, j == nullptr ? nullptr : j + row * width());
    for (const Problem::Length& length : problem_.lengths()) {
      this->length(length, r + row, j == nullptr ? nullptr : j + row * width());
      ++row;
    }
  }

 private:
  std::ptrdiff_t width() const { return problem_.size(); }

  int touch(std::size_t i, double* r, double* j) {
    const TargetBlock& block = problem_.blocks()[problem_.block_of(i)];
    const int rows = problem_.rows(i), shared = problem_.shared_size();
    problem_.residual_m(i, x_.data(), x_.data() + block.first, r,
                        j == nullptr ? nullptr : by_shared_.data(),
                        j == nullptr ? nullptr : by_target_);
    const double weight = 1.0 / std::max(problem_.sigma_m(i), floor_m_);
    for (int k = 0; k < rows; ++k) {
      r[k] *= weight;
      if (j == nullptr) continue;
      for (int c = 0; c < shared; ++c)
        j[k * width() + c] = by_shared_[k * shared + c] * weight * problem_.unknowns()[c].scale;
      for (int c = 0; c < block.size(); ++c)
        j[k * width() + block.first + c] =
            by_target_[k * block.size() + c] * weight * problem_.unknowns()[block.first + c].scale;
    }
    return rows;
  }

  void length(const Problem::Length& length, double* r, double* j) const {
    const int a = problem_.blocks()[length.block_a].first;
    const int b = problem_.blocks()[length.block_b].first;
    const Eigen::Vector3d between = Eigen::Map<const Eigen::Vector3d>(x_.data() + a) -
                                    Eigen::Map<const Eigen::Vector3d>(x_.data() + b);
    const double distance = between.norm(), sigma_m = std::max(length.sigma_m, floor_m_);
    *r = (distance - length.length_m) / sigma_m;
    if (j == nullptr) return;
    const Eigen::Vector3d n =
        distance > 0.0 ? Eigen::Vector3d(between / distance) : Eigen::Vector3d::UnitX();
    for (int k = 0; k < 3; ++k) {
      j[a + k] = n[k] * problem_.unknowns()[a + k].scale / sigma_m;
      j[b + k] = -n[k] * problem_.unknowns()[b + k].scale / sigma_m;
    }
  }

  const Problem& problem_;
  const std::vector<bool>& use_;
  double floor_m_;
  int count_;
  std::vector<double> x_, by_shared_;
  double by_target_[3 * TargetBlock::kMost] = {};
};

/// All residuals at once: touches and lengths, then the priors. One block instead of one per touch
/// spares Ceres its bookkeeping, which would cost more than the arithmetic.
class Objective final : public ceres::CostFunction {
 public:
  Objective(const Problem& problem, const SolveOptions& options)
      : problem_(problem),
        rows_(problem, options.use, options.sigma_floor_m),
        cauchy_(options.cauchy_sigma) {
    touch_rows_ = rows_.count() - static_cast<int>(problem.lengths().size());
    for (int i = 0; i < problem.size(); ++i)
      if (problem.unknowns()[i].prior_weight > 0.0) held_.push_back(i);
    set_num_residuals(rows_.count() + static_cast<int>(held_.size()));
    mutable_parameter_block_sizes()->push_back(problem.size());
  }

  bool Evaluate(double const* const* parameters, double* r, double** jacobians) const override {
    const double* u = parameters[0];
    double* j = jacobians != nullptr ? jacobians[0] : nullptr;  // row-major
    if (j != nullptr)
      std::fill_n(j, static_cast<std::size_t>(num_residuals()) * problem_.size(), 0.0);
    rows_.evaluate(u, r, j);
    if (cauchy_ > 0.0) robustify(r, j);
    int row = rows_.count();
    for (const int i : held_) {
      const Unknown& unknown = problem_.unknowns()[i];
      r[row] = unknown.prior_weight * (u[i] - unknown.prior_mean_u);
      if (j != nullptr)
        j[row * static_cast<std::ptrdiff_t>(problem_.size()) + i] = unknown.prior_weight;
      ++row;
    }
    return true;
  }

  /// Normal equations lose half the digits. That is nothing where a touch is worth 10 um, and too
  /// much for noise-free data, which weigh a million times more against the priors.
  bool needs_all_digits(const double* u) const {
    std::vector<double> r(static_cast<std::size_t>(num_residuals()));
    std::vector<double> j(r.size() * static_cast<std::size_t>(problem_.size()));
    double* jacobian = j.data();
    Evaluate(&u, r.data(), &jacobian);
    constexpr double kLargestSquare = 1e11;
    const Eigen::Map<const RowMajor> m(j.data(), num_residuals(), problem_.size());
    return m.colwise().squaredNorm().maxCoeff() > kLargestSquare;
  }

 private:
  /// Cauchy's loss as a change of the residual: f(r) = c sqrt(log(1 + r^2/c^2)), so that the sum of
  /// f^2 is the robust cost. Smooth at 0, where f(r) -> r.
  void robustify(double* r, double* j) const {
    for (int k = 0; k < touch_rows_; ++k) {
      const double q = r[k] / cauchy_, s = q * q;
      if (s < 1e-12) continue;
      const double f = cauchy_ * std::sqrt(std::log1p(s));
      const double slope = r[k] / (f * (1.0 + s));
      r[k] = std::copysign(f, r[k]);
      if (j != nullptr)
        for (int c = 0; c < problem_.size(); ++c)
          j[k * static_cast<std::ptrdiff_t>(problem_.size()) + c] *= std::abs(slope);
    }
  }

  const Problem& problem_;
  mutable Rows rows_;
  double cauchy_;
  int touch_rows_ = 0;
  std::vector<int> held_;
};

}  // namespace

SolveResult solve(const Problem& problem, const Eigen::VectorXd& start,
                  const SolveOptions& options) {
  SolveResult result;
  result.u = start;
  auto objective = std::make_unique<Objective>(problem, options);
  const bool exact = objective->needs_all_digits(start.data());
  ceres::Problem solver_problem;
  solver_problem.AddResidualBlock(objective.release(), nullptr, result.u.data());

  // Relative changes of the cost. A robust fit only has to show who does not belong; the final one
  // converges quadratically, so a last step of 1e-9 leaves less than rounding does.
  constexpr double kRobustTolerance = 1e-3, kTolerance = 1e-9;
  constexpr int kRobustIterations = 25;
  const bool robust = options.cauchy_sigma > 0.0;
  ceres::Solver::Options o;
  o.linear_solver_type = exact ? ceres::DENSE_QR : ceres::DENSE_NORMAL_CHOLESKY;
  o.max_num_iterations =
      robust ? std::min(kRobustIterations, options.max_iterations) : options.max_iterations;
  o.function_tolerance = robust ? kRobustTolerance : kTolerance;
  o.gradient_tolerance = 1e-14;
  o.parameter_tolerance = 1e-9;
  // Prior units are already well scaled; Ceres' own scaling would only blur the damping.
  o.jacobi_scaling = false;
  o.initial_trust_region_radius = 1e8;  // errors are small: nearly Gauss-Newton from the start
  o.logging_type = ceres::SILENT;
  o.num_threads = 1;  // same bits every time
  ceres::Solver::Summary summary;
  ceres::Solve(o, &solver_problem, &summary);
  result.iterations = static_cast<int>(summary.iterations.size());
  result.converged = robust || summary.termination_type == ceres::CONVERGENCE;
  if (!summary.IsSolutionUsable() || !result.u.allFinite())
    throw IdentifyError("the solver failed: " + summary.message);
  return result;
}

Linearisation linearise(const Problem& problem, const Eigen::VectorXd& u,
                        const std::vector<bool>& use) {
  Linearisation result;
  Rows rows(problem, use);
  result.jacobian = RowMajor::Zero(rows.count(), problem.size());
  result.residual.resize(rows.count());
  rows.evaluate(u.data(), result.residual.data(), result.jacobian.data());
  int row = 0;
  for (std::size_t i = 0; i < problem.touches().size(); ++i) {
    if (!use[i]) continue;
    result.touch_row.emplace_back(i, row);
    row += problem.rows(i);
  }
  result.length_row = row;
  return result;
}

}  // namespace cellcal::calib
