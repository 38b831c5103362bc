#include "calib/estimate/solve.h"

#include <ceres/ceres.h>
#include <glog/logging.h>

#include <algorithm>
#include <cmath>
#include <deque>

#include "calib/estimate/parallel.h"
#include "calib/model/error.h"
#include "calib/model/long_work.h"
#include "calib/model/product.h"

namespace cellcal::calib {

namespace {

/// The rows of least squares: whitened residuals of touches and of certified lengths, and their
/// derivatives by the unknowns, (12). Owns its workspace: rows are evaluated without allocation.
/// `problem` must outlive it.
class WhitenedRows {
 public:
  explicit WhitenedRows(const Problem& problem, double sigma_floor_m = 0.0)
      : problem_(problem),
        floor_m_(sigma_floor_m),
        scale_(problem.scales()),
        by_shared_(static_cast<std::size_t>(Problem::kMostRows * problem.shared_size())) {}

  /// Sets the point at which the following rows are evaluated; u in prior units.
  void at(const double* u) {
    x_ = problem_.to_si(Eigen::Map<const Eigen::VectorXd>(u, problem_.size()));
    at_ = problem_.at(x_.data());
  }

  /// Residuals of a touch and their derivatives, in rows of length `width`, of which the problem's
  /// size is written; null if not needed. Returns the number of rows.
  int touch(std::size_t i, double* r, double* j, std::ptrdiff_t width) {
    const double weight = 1.0 / std::max(problem_.sigma_m(i), floor_m_);
    const int rows = problem_.rows(i);
    if (j == nullptr) {
      problem_.residual_m(i, at_, r, nullptr, nullptr);
      for (int k = 0; k < rows; ++k) r[k] *= weight;
      return rows;
    }
    const TargetBlock& block = problem_.blocks()[problem_.block_of(i)];
    const int shared = problem_.shared_size(), own = block.size();
    double* by_shared = rows == 1 ? j : by_shared_.data();  // one row is written to its final place
    problem_.residual_m(i, at_, r, by_shared, by_target_);
    for (int k = 0; k < rows; ++k) {
      r[k] *= weight;
      Eigen::Map<Eigen::VectorXd> to(j + k * width, width);
      to.head(shared) = weight * Eigen::Map<const Eigen::VectorXd>(by_shared + k * shared, shared)
                                     .cwiseProduct(scale_.head(shared));
      to.segment(shared, problem_.size() - shared).setZero();
      to.segment(block.first, own) =
          weight * Eigen::Map<const Eigen::VectorXd>(by_target_ + k * own, own)
                       .cwiseProduct(scale_.segment(block.first, own));
    }
    return rows;
  }

  /// Residual of a certified length and its derivatives; null if not needed.
  void length(const Problem::Length& length, double* r, double* j) const {
    const int a = problem_.blocks()[length.block_a].first;
    const int b = problem_.blocks()[length.block_b].first;
    const Eigen::Vector3d between = x_.segment<3>(a) - x_.segment<3>(b);
    const double distance = between.norm(), sigma_m = std::max(length.fit_sigma_m(), floor_m_);
    *r = (distance - length.length_m) / sigma_m;  // (12)
    if (j == nullptr) return;
    const Eigen::Vector3d n =
        distance > 0.0 ? Eigen::Vector3d(between / distance) : Eigen::Vector3d::UnitX();
    for (int k = 0; k < 3; ++k) {
      j[a + k] = n[k] * scale_[a + k] / sigma_m;
      j[b + k] = -n[k] * scale_[b + k] / sigma_m;
    }
  }

 private:
  const Problem& problem_;
  double floor_m_;
  Eigen::VectorXd x_, scale_;
  std::vector<double> by_shared_;
  Problem::At at_{};
  double by_target_[Problem::kMostRows * TargetBlock::kMost] = {};
};

/// Sum of squares over touches, lengths and priors for Ceres, reduced to one row per unknown and
/// one for the remainder that no unknown changes, for any number of touches. Cost, gradient and
/// Gauss-Newton steps are those of all rows.
class Objective final : public ceres::CostFunction {
 public:
  Objective(const Problem& problem, const SolveOptions& options, bool all_digits)
      : problem_(problem),
        use_(options.use),
        cauchy_(options.cauchy_sigma),
        all_digits_(all_digits) {
    while (parts_.size() < parts_of(use_.size()))
      parts_.emplace_back(problem, options.sigma_floor_m);
    set_num_residuals(problem.size() + 1);
    mutable_parameter_block_sizes()->push_back(problem.size());
  }

  bool Evaluate(double const* const* parameters, double* r, double** jacobians) const override {
    const int n = problem_.size();
    Eigen::Map<Eigen::VectorXd> residual(r, n + 1);
    if (jacobians == nullptr || jacobians[0] == nullptr) {
      residual.setZero();
      residual[n] = std::sqrt(sum_of_squares(parameters[0]));
      return true;
    }
    const Eigen::MatrixXd triangle = gather(parameters[0], false).triangle();
    residual = triangle.col(n);
    Eigen::Map<RowMajor> j(jacobians[0], n + 1, n);
    j = triangle.leftCols(n);
    return true;
  }

  /// All rows at u. `reweighted`: robust loss as a weight of residual and derivative, for a step
  /// without line search; otherwise as a transformed residual, whose square is the loss.
  Information gather(const double* u, bool reweighted) const {
    at(u);
    Information information(problem_.size(), all_digits_);
    Eigen::VectorXd weight(problem_.size());
    for (int i = 0; i < problem_.size(); ++i) weight[i] = problem_.unknowns()[i].prior_weight;
    information.add_alone(weight, prior_residual(u));
    if (parts_.size() == 1) {
      add_touches(information, parts_[0], 0, use_.size(), reweighted);
    } else {
      std::vector<Information> sums(parts_.size(), Information(problem_.size(), all_digits_));
      by_parts(use_.size(), [&](std::size_t part, std::size_t first, std::size_t behind) {
        add_touches(sums[part], parts_[part], first, behind, reweighted);
      });
      for (const Information& sum : sums) information.add(sum);
    }
    add_lengths(information);
    return information;
  }

 private:
  static constexpr Eigen::Index kRows = 128;  // at a time; stays in the cache

  /// Part of the touches, with its own workspace.
  struct Part {
    Part(const Problem& problem, double sigma_floor_m)
        : rows(problem, sigma_floor_m), block(kRows, problem.size() + 1) {}
    WhitenedRows rows;
    RowMajor block;
  };

  void at(const double* u) const {
    for (Part& part : parts_) part.rows.at(u);
  }

  Eigen::VectorXd prior_residual(const double* u) const {
    Eigen::VectorXd off(problem_.size());
    for (int i = 0; i < problem_.size(); ++i) {
      const Unknown& unknown = problem_.unknowns()[i];
      off[i] = unknown.prior_weight * (u[i] - unknown.prior_mean_u);
    }
    return off;
  }

  double sum_of_squares(const double* u) const {
    at(u);
    std::vector<double> sums(parts_.size(), 0.0);
    by_parts(use_.size(), [&](std::size_t part, std::size_t first, std::size_t behind) {
      double r[Problem::kMostRows];
      for (std::size_t i = first; i < behind; ++i) {
        if (!use_[i]) continue;
        const int rows = parts_[part].rows.touch(i, r, nullptr, 0);
        for (int k = 0; k < rows; ++k) sums[part] += square(r[k]);
      }
    });
    double sum = prior_residual(u).squaredNorm(), r[1];  // (17)
    for (const double part : sums) sum += part;
    for (const Problem::Length& length : problem_.lengths()) {
      parts_[0].rows.length(length, r, nullptr);
      sum += r[0] * r[0];
    }
    return sum;
  }

  void add_touches(Information& information, Part& part, std::size_t first, std::size_t behind,
                   bool reweighted) const {
    const Eigen::Index n = problem_.size();
    Eigen::Index row = 0;
    double r[Problem::kMostRows];
    for (std::size_t i = first; i < behind; ++i) {
      if (!use_[i]) continue;
      const int rows = part.rows.touch(i, r, part.block.row(row).data(), n + 1);
      for (int k = 0; k < rows; ++k, ++row) {
        part.block(row, n) = r[k];
        if (cauchy_ > 0.0) robustify(part.block.row(row), reweighted);
      }
      if (row + Problem::kMostRows <= kRows) continue;
      information.add(part.block.topRows(row));
      row = 0;
    }
    information.add(part.block.topRows(row));
  }

  void add_lengths(Information& information) const {
    const auto count = static_cast<Eigen::Index>(problem_.lengths().size());
    if (count == 0) return;
    RowMajor rows = RowMajor::Zero(count, problem_.size() + 1);
    for (Eigen::Index k = 0; k < count; ++k)
      parts_[0].rows.length(problem_.lengths()[static_cast<std::size_t>(k)],
                            &rows(k, problem_.size()), rows.row(k).data());
    information.add(rows);
  }

  /// (18): Cauchy's loss kappa^2 log(1 + r^2/kappa^2) of a touch.
  double square(double r) const {
    const double s = cauchy_ > 0.0 ? std::pow(r / cauchy_, 2) : 0.0;
    return s < kSmooth ? r * r : cauchy_ * cauchy_ * std::log1p(s);
  }

  /// Robust loss as a transformed residual: f(r) = kappa sqrt(log(1 + r^2/kappa^2)), so that the
  /// sum of f^2 is the robust cost. Smooth at 0, where f(r) -> r.
  void robustify(RowMajor::RowXpr row, bool reweighted) const {
    const Eigen::Index n = problem_.size();
    double& r = row[n];
    const double s = std::pow(r / cauchy_, 2);
    if (s < kSmooth) return;
    if (reweighted) {
      row /= std::sqrt(1.0 + s);
      return;
    }
    const double f = std::copysign(cauchy_ * std::sqrt(std::log1p(s)), r);
    row.head(n) *= r / (f * (1.0 + s));
    r = f;
  }
  static constexpr double kSmooth = 1e-12;

  const Problem& problem_;
  const std::vector<bool>& use_;
  double cauchy_;
  bool all_digits_;
  mutable std::deque<Part> parts_;
};

/// Stops the solver on cancellation, since no exception may pass through Ceres.
class PollCancelled final : public ceres::IterationCallback {
 public:
  ceres::CallbackReturnType operator()(const ceres::IterationSummary&) override {
    return is_cancelled() ? ceres::SOLVER_ABORT : ceres::SOLVER_CONTINUE;
  }
};

}  // namespace

bool needs_all_digits(const Problem& problem, const SolveOptions& options) {
  constexpr double kPriorMoveM = 2e-3;  // of the tip, by the prior uncertainty of an arm
  constexpr double kLargestSquare = 1e11;
  double square = 0.0;
  for (std::size_t i = 0; i < problem.touches().size(); ++i)
    if (options.use[i])
      square += std::pow(kPriorMoveM / std::max(problem.sigma_m(i), options.sigma_floor_m), 2);
  return square > kLargestSquare;
}

SolveResult solve(const Problem& problem, const Eigen::VectorXd& start,
                  const SolveOptions& options) {
  SolveResult result;
  result.u = start;
  const bool exact = needs_all_digits(problem, options);
  ceres::Problem solver_problem;
  solver_problem.AddResidualBlock(new Objective(problem, options, exact), nullptr,  // Ceres owns it
                                  result.u.data());

  // A robust fit only has to show the outliers.
  constexpr double kRobustTolerance = 1e-3;
  constexpr int kRobustIterations = 25;
  const bool robust = options.cauchy_sigma > 0.0;
  ceres::Solver::Options o;
  o.linear_solver_type = exact ? ceres::DENSE_QR : ceres::DENSE_NORMAL_CHOLESKY;
  o.max_num_iterations =
      robust ? std::min(kRobustIterations, options.max_iterations) : options.max_iterations;
  o.function_tolerance = robust ? kRobustTolerance : options.tolerance;
  o.gradient_tolerance = 1e-14;
  o.parameter_tolerance = 1e-9;
  // Prior units are already well scaled; Ceres' own scaling would only blur the damping.
  o.jacobi_scaling = false;
  o.initial_trust_region_radius = 1e8;  // errors are small: nearly Gauss-Newton from the start
  o.logging_type = ceres::SILENT;
  o.num_threads = 1;  // the objective's parts use the threads, with reproducible bits
  PollCancelled poll;
  o.callbacks.push_back(&poll);
  poll_cancelled();
  ceres::Solver::Summary summary;
  ceres::Solve(o, &solver_problem, &summary);
  poll_cancelled();
  result.iterations = static_cast<int>(summary.iterations.size());
  result.converged = summary.termination_type == ceres::CONVERGENCE;
  if (!summary.IsSolutionUsable() || !result.u.allFinite())
    throw IdentifyError(IdentifyError::Kind::kNotSolved, "the solver failed: " + summary.message);
  return result;
}

Eigen::VectorXd step_towards(const Problem& problem, const Eigen::VectorXd& u,
                             const SolveOptions& options) {
  poll_cancelled();
  const Objective objective(problem, options, needs_all_digits(problem, options));
  const Eigen::MatrixXd triangle = objective.gather(u.data(), true).triangle();
  const Eigen::Index n = u.size();
  Eigen::VectorXd step = triangle.col(n).head(n);
  triangle.topLeftCorner(n, n).triangularView<Eigen::Upper>().solveInPlace(step);
  return u - step;
}

void linearise(const Problem& problem, const Eigen::VectorXd& u, const std::vector<bool>& use,
               Linearisation& result) {
  poll_cancelled();
  int count = static_cast<int>(problem.lengths().size());
  for (std::size_t i = 0; i < use.size(); ++i)
    if (use[i]) count += problem.rows(i);
  result.jacobian.resize(count, problem.size());
  result.residual.resize(count);
  result.touch_row.clear();
  int row = 0;
  for (std::size_t i = 0; i < use.size(); ++i) {
    if (!use[i]) continue;
    result.touch_row.emplace_back(i, row);
    row += problem.rows(i);
  }
  by_parts(result.touch_row.size(), [&](std::size_t, std::size_t first, std::size_t behind) {
    WhitenedRows rows(problem);
    rows.at(u.data());
    for (std::size_t k = first; k < behind; ++k) {
      const auto& [touch, at] = result.touch_row[k];
      rows.touch(touch, result.residual.data() + at, result.jacobian.row(at).data(),
                 problem.size());
    }
  });
  result.length_row = row;
  result.jacobian.bottomRows(count - row).setZero();
  WhitenedRows rows(problem);
  rows.at(u.data());
  for (const Problem::Length& length : problem.lengths()) {
    rows.length(length, result.residual.data() + row, result.jacobian.row(row).data());
    ++row;
  }
}

Linearisation linearise(const Problem& problem, const Eigen::VectorXd& u,
                        const std::vector<bool>& use) {
  Linearisation result;
  linearise(problem, u, use, result);
  return result;
}

Linearisation linearise_touch(const Problem& problem, const Eigen::VectorXd& u, std::size_t touch) {
  Linearisation result;
  const int count = problem.rows(touch);
  result.jacobian.resize(count, problem.size());
  result.residual.resize(count);
  result.touch_row.emplace_back(touch, 0);
  result.length_row = count;
  WhitenedRows rows(problem);
  rows.at(u.data());
  rows.touch(touch, result.residual.data(), result.jacobian.data(), problem.size());
  return result;
}

Eigen::VectorXd leverage_of(const RowMajor& rows, const Eigen::MatrixXd& covariance_u) {
  Eigen::VectorXd result(rows.rows());
  const auto count = static_cast<std::size_t>(rows.rows());
  by_parts(count, [&](std::size_t, std::size_t begin, std::size_t behind) {
    constexpr Eigen::Index kRows = 128;  // stays in the cache
    const auto end = static_cast<Eigen::Index>(behind);
    for (auto first = static_cast<Eigen::Index>(begin); first < end; first += kRows) {
      const auto some = rows.middleRows(first, std::min(kRows, end - first));
      result.segment(first, some.rows()) =
          product(some, covariance_u).cwiseProduct(some).rowwise().sum();
    }
  });
  return result;
}

void quiet_solver() { FLAGS_minloglevel = google::GLOG_FATAL; }

}  // namespace cellcal::calib
