#include "calib/identify/solve.h"

#include <ceres/ceres.h>

#include "calib/files/error.h"

namespace cellcal::calib {

namespace {

using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// SI values of a block of unknowns, u given.
void to_si(const Problem& problem, int first, int count, const double* u, double* x) {
  for (int i = 0; i < count; ++i) {
    const Unknown& unknown = problem.unknowns()[first + i];
    x[i] = unknown.origin + unknown.scale * u[i];
  }
}

/// Derivatives by SI unknowns to whitened derivatives by u, in place.
void to_prior_units(const Problem& problem, int first, int count, double weight, int rows,
                    double* j) {
  Eigen::Map<RowMajor> m(j, rows, count);
  for (int i = 0; i < count; ++i) m.col(i) *= weight * problem.unknowns()[first + i].scale;
}

class TouchCost final : public ceres::CostFunction {
 public:
  TouchCost(const Problem& problem, std::size_t touch)
      : problem_(problem), touch_(touch), block_(problem.blocks()[problem.block_of(touch)]) {
    set_num_residuals(problem.rows(touch));
    mutable_parameter_block_sizes()->push_back(problem.shared_size());
    mutable_parameter_block_sizes()->push_back(block_.size());
    shared_.resize(problem.shared_size());
  }

  bool Evaluate(double const* const* u, double* r, double** jacobians) const override {
    double target[4];
    to_si(problem_, 0, problem_.shared_size(), u[0], shared_.data());
    to_si(problem_, block_.first, block_.size(), u[1], target);
    double* by_shared = jacobians != nullptr ? jacobians[0] : nullptr;
    double* by_target = jacobians != nullptr ? jacobians[1] : nullptr;
    problem_.residual_m(touch_, shared_.data(), target, r, by_shared, by_target);
    const double weight = 1.0 / problem_.sigma_m(touch_);
    const int rows = num_residuals();
    for (int k = 0; k < rows; ++k) r[k] *= weight;
    if (by_shared != nullptr)
      to_prior_units(problem_, 0, problem_.shared_size(), weight, rows, by_shared);
    if (by_target != nullptr)
      to_prior_units(problem_, block_.first, block_.size(), weight, rows, by_target);
    return true;
  }

 private:
  const Problem& problem_;
  std::size_t touch_;
  const TargetBlock& block_;
  mutable std::vector<double> shared_;
};

double length_residual(const Problem& problem, const Problem::Length& length, const double* u_a,
                       const double* u_b, double* j_a, double* j_b) {
  const TargetBlock& a = problem.blocks()[length.block_a];
  const TargetBlock& b = problem.blocks()[length.block_b];
  double x_a[4], x_b[4];
  to_si(problem, a.first, a.size(), u_a, x_a);
  to_si(problem, b.first, b.size(), u_b, x_b);
  const Eigen::Vector3d between =
      Eigen::Map<const Eigen::Vector3d>(x_a) - Eigen::Map<const Eigen::Vector3d>(x_b);
  const double distance = between.norm();
  const Eigen::Vector3d n =
      distance > 0.0 ? Eigen::Vector3d(between / distance) : Eigen::Vector3d::UnitX();
  for (int k = 0; k < 3; ++k) {
    if (j_a != nullptr) j_a[k] = n[k] * problem.unknowns()[a.first + k].scale / length.sigma_m;
    if (j_b != nullptr) j_b[k] = -n[k] * problem.unknowns()[b.first + k].scale / length.sigma_m;
  }
  if (j_a != nullptr && a.has_radius) j_a[3] = 0.0;
  if (j_b != nullptr && b.has_radius) j_b[3] = 0.0;
  return (distance - length.length_m) / length.sigma_m;
}

class LengthCost final : public ceres::CostFunction {
 public:
  LengthCost(const Problem& problem, const Problem::Length& length)
      : problem_(problem), length_(length) {
    set_num_residuals(1);
    mutable_parameter_block_sizes()->push_back(problem.blocks()[length.block_a].size());
    mutable_parameter_block_sizes()->push_back(problem.blocks()[length.block_b].size());
  }
  bool Evaluate(double const* const* u, double* r, double** jacobians) const override {
    r[0] = length_residual(problem_, length_, u[0], u[1], jacobians ? jacobians[0] : nullptr,
                           jacobians ? jacobians[1] : nullptr);
    return true;
  }

 private:
  const Problem& problem_;
  const Problem::Length& length_;
};

/// weight * (u - mean), one row per unknown of the block that has a prior.
class PriorCost final : public ceres::CostFunction {
 public:
  PriorCost(const Problem& problem, int first, int count) : problem_(problem), first_(first) {
    for (int i = 0; i < count; ++i)
      if (problem.unknowns()[first + i].prior_weight > 0.0) held_.push_back(i);
    count_ = count;
    set_num_residuals(static_cast<int>(held_.size()));
    mutable_parameter_block_sizes()->push_back(count);
  }
  bool useful() const { return !held_.empty(); }
  bool Evaluate(double const* const* u, double* r, double** jacobians) const override {
    if (jacobians != nullptr && jacobians[0] != nullptr)
      Eigen::Map<RowMajor>(jacobians[0], num_residuals(), count_).setZero();
    for (std::size_t row = 0; row < held_.size(); ++row) {
      const int i = held_[row];
      const Unknown& unknown = problem_.unknowns()[first_ + i];
      r[row] = unknown.prior_weight * (u[0][i] - unknown.prior_mean_u);
      if (jacobians != nullptr && jacobians[0] != nullptr)
        jacobians[0][static_cast<int>(row) * count_ + i] = unknown.prior_weight;
    }
    return true;
  }

 private:
  const Problem& problem_;
  int first_, count_ = 0;
  std::vector<int> held_;
};

/// Rows above this: normal equations. Below it QR, which keeps all digits of noise-free data.
constexpr int kRowsForQr = 2000;

}  // namespace

SolveResult solve(const Problem& problem, const Eigen::VectorXd& start,
                  const SolveOptions& options) {
  SolveResult result;
  result.u = start;
  ceres::Problem::Options ownership;
  ownership.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ownership.enable_fast_removal = false;
  ceres::Problem solver_problem(ownership);
  ceres::CauchyLoss cauchy(options.cauchy_sigma > 0.0 ? options.cauchy_sigma : 1.0);
  ceres::LossFunction* loss = options.cauchy_sigma > 0.0 ? &cauchy : nullptr;

  double* u = result.u.data();
  int rows = 0;
  const auto add_prior = [&](int first, int count) {
    auto cost = std::make_unique<PriorCost>(problem, first, count);
    if (!cost->useful()) return;
    rows += cost->num_residuals();
    solver_problem.AddResidualBlock(cost.release(), nullptr, u + first);
  };
  add_prior(0, problem.shared_size());
  for (const TargetBlock& block : problem.blocks()) add_prior(block.first, block.size());
  for (std::size_t i = 0; i < problem.touches().size(); ++i) {
    if (!options.use[i]) continue;
    rows += problem.rows(i);
    solver_problem.AddResidualBlock(new TouchCost(problem, i), loss, u,
                                    u + problem.blocks()[problem.block_of(i)].first);
  }
  for (const Problem::Length& length : problem.lengths()) {
    ++rows;
    solver_problem.AddResidualBlock(new LengthCost(problem, length), nullptr,
                                    u + problem.blocks()[length.block_a].first,
                                    u + problem.blocks()[length.block_b].first);
  }

  ceres::Solver::Options o;
  o.linear_solver_type = rows <= kRowsForQr ? ceres::DENSE_QR : ceres::DENSE_NORMAL_CHOLESKY;
  o.max_num_iterations = options.max_iterations;
  o.function_tolerance = 1e-14;
  o.gradient_tolerance = 1e-14;
  o.parameter_tolerance = 1e-12;
  // Prior units are already well scaled; Ceres' own scaling would only blur the damping.
  o.jacobi_scaling = false;
  o.initial_trust_region_radius = 1e8;  // errors are small: nearly Gauss-Newton from the start
  o.logging_type = ceres::SILENT;
  o.num_threads = 1;  // same bits every time
  ceres::Solver::Summary summary;
  ceres::Solve(o, &solver_problem, &summary);
  result.iterations = static_cast<int>(summary.iterations.size());
  result.converged = summary.termination_type == ceres::CONVERGENCE;
  if (!summary.IsSolutionUsable() || !result.u.allFinite())
    throw IdentifyError("the solver failed: " + summary.message);
  return result;
}

Linearisation linearise(const Problem& problem, const Eigen::VectorXd& u,
                        const std::vector<bool>& use) {
  Linearisation result;
  int rows = 0;
  for (std::size_t i = 0; i < problem.touches().size(); ++i)
    if (use[i]) rows += problem.rows(i);
  result.length_row = rows;
  rows += static_cast<int>(problem.lengths().size());
  result.jacobian = Eigen::MatrixXd::Zero(rows, problem.size());
  result.residual.resize(rows);
  const Eigen::VectorXd x = problem.to_si(u);
  const int shared = problem.shared_size();
  RowMajor by_shared(3, shared), by_target(3, 4);
  double r[3];
  int row = 0;
  for (std::size_t i = 0; i < problem.touches().size(); ++i) {
    if (!use[i]) continue;
    const TargetBlock& block = problem.blocks()[problem.block_of(i)];
    problem.residual_m(i, x.data(), x.data() + block.first, r, by_shared.data(), by_target.data());
    const int n = problem.rows(i);
    const double weight = 1.0 / problem.sigma_m(i);
    const Eigen::Map<RowMajor> js(by_shared.data(), n, shared);
    const Eigen::Map<RowMajor> jt(by_target.data(), n, block.size());
    for (int k = 0; k < n; ++k) result.residual[row + k] = r[k] * weight;
    for (int c = 0; c < shared; ++c)
      result.jacobian.block(row, c, n, 1) = js.col(c) * (weight * problem.unknowns()[c].scale);
    for (int c = 0; c < block.size(); ++c)
      result.jacobian.block(row, block.first + c, n, 1) =
          jt.col(c) * (weight * problem.unknowns()[block.first + c].scale);
    result.touch_row.emplace_back(i, row);
    row += n;
  }
  for (const Problem::Length& length : problem.lengths()) {
    const TargetBlock& a = problem.blocks()[length.block_a];
    const TargetBlock& b = problem.blocks()[length.block_b];
    double j_a[4], j_b[4];
    result.residual[row] =
        length_residual(problem, length, u.data() + a.first, u.data() + b.first, j_a, j_b);
    for (int k = 0; k < 3; ++k) {
      result.jacobian(row, a.first + k) = j_a[k];
      result.jacobian(row, b.first + k) = j_b[k];
    }
    ++row;
  }
  return result;
}

}  // namespace cellcal::calib
