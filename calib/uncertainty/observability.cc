#include "calib/uncertainty/observability.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>

#include "calib/linear/cholesky.h"
#include "calib/linear/eigenpairs.h"
#include "calib/linear/orthogonal.h"

namespace cellcal::calib {

namespace {

/// A step of one tolerance that changes all measurements together by less than a thousandth of a
/// sigma is not seen at all.
constexpr double kSeen = 1e-3;
/// Half of the digits: singular values come from their squares.
constexpr double kRounding = 1e-7;
/// What every nuisance is seen by, at least, so that its block has an inverse.
constexpr double kFlatDirection = 1e-3;

/// Columns of the arm that every model level has: geometry, tool and bending.
bool is_geometry(ParameterKind kind) {
  return !is_compliance(kind) && !is_transmission(kind) && kind != ParameterKind::kPlay;
}

/// J'J over some columns, lower part; by blocks that stay in the cache, however many rows.
Eigen::MatrixXd gram_of(const RowMajor& jacobian, const std::vector<int>& columns) {
  const auto width = static_cast<Eigen::Index>(columns.size());
  Eigen::MatrixXd gram = Eigen::MatrixXd::Zero(width, width);
  constexpr Eigen::Index kRows = 128;
  Eigen::MatrixXd block;
  for (Eigen::Index first = 0; first < jacobian.rows(); first += kRows) {
    const Eigen::Index rows = std::min(kRows, jacobian.rows() - first);
    block.resize(width, rows);
    for (Eigen::Index r = 0; r < rows; ++r)
      for (Eigen::Index k = 0; k < width; ++k)
        block(k, r) = jacobian(first + r, columns[static_cast<std::size_t>(k)]);
    gram.selfadjointView<Eigen::Lower>().rankUpdate(block);
  }
  return gram;
}

}  // namespace

Observability indices_of(std::span<const double> singular_values, int rows) {
  Observability o;
  o.rows = rows;
  o.directions = static_cast<int>(singular_values.size());
  o.singular_values.assign(singular_values.begin(), singular_values.end());
  std::sort(o.singular_values.begin(), o.singular_values.end(), std::greater<>());
  if (o.singular_values.empty() || rows == 0) return o;
  const double largest = o.singular_values.front();
  double log_sum = 0.0, inverse_sum = 0.0, smallest = 0.0;
  for (const double s : o.singular_values) {
    if (!(s > std::max(kSeen, kRounding * largest))) break;
    ++o.rank;
    if (s > 1.0) ++o.determined;
    log_sum += std::log(s);
    inverse_sum += 1.0 / s;
    smallest = s;
  }
  if (o.rank == 0) return o;
  o.o1 = std::exp(log_sum / o.rank) / std::sqrt(rows);  // (43)
  o.o2 = smallest / largest;
  o.o3 = smallest;
  o.o4 = smallest * smallest / largest;
  o.o5 = 1.0 / inverse_sum;
  o.condition = largest / smallest;
  return o;
}

Observability observability(const Problem& problem, const Linearisation& linear,
                            const Eigen::MatrixXd& frame_basis_u) {
  std::vector<int> columns;  // geometry, then nuisances: where the targets are, and radii
  for (int i = 0; i < problem.arm_size(); ++i)
    if (is_geometry(problem.arm().parameters()[static_cast<std::size_t>(i)].kind))
      columns.push_back(i);
  const auto geometry = static_cast<Eigen::Index>(columns.size());
  for (int i = problem.arm_size(); i < problem.size(); ++i) columns.push_back(i);
  const Eigen::Index nuisances = static_cast<Eigen::Index>(columns.size()) - geometry;

  const Eigen::MatrixXd gram = gram_of(linear.jacobian, columns);
  Eigen::MatrixXd nuisance = gram.bottomRightCorner(nuisances, nuisances);
  for (Eigen::Index k = 0; k < nuisances; ++k) {
    const Unknown& unknown = problem.unknowns()[static_cast<std::size_t>(problem.arm_size() + k)];
    nuisance(k, k) += unknown.held_by_geometry
                          ? 1.0
                          : kFlatDirection * kFlatDirection;  // in its own prior sigmas
  }
  Eigen::MatrixXd coupling = gram.bottomLeftCorner(nuisances, geometry);
  coupling = Cholesky(nuisance).whitened(coupling);
  Eigen::MatrixXd left = gram.topLeftCorner(geometry, geometry).selfadjointView<Eigen::Lower>();
  left.noalias() -= coupling.transpose() * coupling;  // (42)

  // The frame's share of the geometry spans what is taken out.
  if (frame_basis_u.cols() > 0 && geometry > 0) {
    Eigen::MatrixXd frame(geometry, frame_basis_u.cols());
    for (Eigen::Index k = 0; k < geometry; ++k)
      frame.row(k) = frame_basis_u.row(columns[static_cast<std::size_t>(k)]);
    left = without_span(std::move(left), frame, kRounding);
  }
  std::vector<double> singular;
  if (left.rows() > 0)
    for (const double square : eigenvalues(left))
      singular.push_back(std::sqrt(std::max(0.0, square)));
  // More directions than rows cannot be seen; what rounding leaves of the others is nothing.
  std::sort(singular.begin(), singular.end(), std::greater<>());
  const auto rows = static_cast<std::size_t>(linear.jacobian.rows());
  for (std::size_t k = rows; k < singular.size(); ++k) singular[k] = 0.0;
  Observability result = indices_of(singular, static_cast<int>(rows));
  result.unknowns = problem.size();
  return result;
}

}  // namespace cellcal::calib
