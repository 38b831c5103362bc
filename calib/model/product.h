#pragma once
// Sums of products of dense matrices, the larger part of an estimate's arithmetic.
//
// Each element is summed in the order of the depth, by a multiplication and an addition per term. The width of the
// processor's vectors changes how many elements are summed at a time and not a bit of any: the result is the same
// on every processor, and that of Eigen's product for a depth of up to kProductDepth. Eigen itself takes the width
// of the compiler's target, two doubles on any x86-64.

#include <Eigen/Core>
#include <vector>

namespace cellcal::calib {

/// A factor: any matrix, block or transpose with its elements in memory, which must outlive it.
struct Factor {
  template <typename Matrix>
  Factor(const Eigen::DenseBase<Matrix>& of)  // NOLINT(google-explicit-constructor): as Eigen::Ref
      : at(of.derived().data()),
        rows(of.rows()),
        columns(of.cols()),
        row_stride(of.derived().rowStride()),
        column_stride(of.derived().colStride()) {}

  const double* at;
  Eigen::Index rows, columns, row_stride, column_stride;
};

/// Terms summed before they are added to the result.
inline constexpr Eigen::Index kProductDepth = 256;

using SumOfProducts = Eigen::Ref<Eigen::MatrixXd, 0, Eigen::OuterStride<>>;

/// sum (m x n) += weight a b, of a (m x d) and b (d x n). The sum must not overlap a factor.
void add_product(double weight, const Factor& a, const Factor& b, SumOfProducts sum);

/// a b
inline Eigen::MatrixXd product(const Factor& a, const Factor& b) {
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(a.rows, b.columns);
  add_product(1.0, a, b, sum);
  return sum;
}

/// Lower triangle of sum (m x m) += weight a a', of a (m x d); the rest of the sum is unchanged.
void add_square(double weight, const Factor& a, SumOfProducts sum);

// A tile of the result is summed in registers, from kTileRows rows of the left factor and kTileColumns columns of
// the right one, each stored term by term.
inline constexpr Eigen::Index kTileRows = 16, kTileColumns = 4;

/// sum (kTileRows x kTileColumns, columns `stride` apart) += weight left right, of `depth` terms.
using TileSum = void (*)(Eigen::Index depth, const double* left, const double* right, double weight,
                         double* sum, Eigen::Index stride);

/// Those that this processor can run, the fastest first.
std::vector<TileSum> tile_sums();

}  // namespace cellcal::calib
