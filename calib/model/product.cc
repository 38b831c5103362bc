#include "calib/model/product.h"

#include <algorithm>
#include <array>
#include <cstring>

namespace cellcal::calib {

namespace {

using Eigen::Index;

// Rows of the left factor whose panels stay in the second-level cache.
constexpr Index kBlockRows = 256;

/// Sums two vectors of `width` rows of a tile.
template <int width>
[[gnu::always_inline]] inline void add_rows(Index depth, const double* left, const double* right,
                                            double weight, double* sum, Index stride) {
  using Vector [[gnu::vector_size(width * sizeof(double))]] = double;
  constexpr int kVectors =
      2;  // sixteen registers hold eight sums, two vectors of rows and a factor
  Vector sums[kTileColumns][kVectors] = {};
  for (Index k = 0; k < depth; ++k, left += kTileRows, right += kTileColumns) {
    Vector rows[kVectors];
#pragma GCC unroll 4
    for (int r = 0; r < kVectors; ++r) std::memcpy(&rows[r], left + r * width, sizeof(Vector));
#pragma GCC unroll 4
    for (int c = 0; c < kTileColumns; ++c)
#pragma GCC unroll 4
      for (int r = 0; r < kVectors; ++r) sums[c][r] += rows[r] * right[c];
  }
#pragma GCC unroll 4
  for (int c = 0; c < kTileColumns; ++c)
#pragma GCC unroll 4
    for (int r = 0; r < kVectors; ++r) {
      double* at = sum + c * stride + r * width;
      Vector before;
      std::memcpy(&before, at, sizeof(Vector));
      before += sums[c][r] * weight;
      std::memcpy(at, &before, sizeof(Vector));
    }
}

template <int width>
[[gnu::always_inline]] inline void add_tile(Index depth, const double* left, const double* right,
                                            double weight, double* sum, Index stride) {
  for (Index row = 0; row < kTileRows; row += 2 * width)
    add_rows<width>(depth, left + row, right, weight, sum + row, stride);
}

void add_tile_by_two(Index depth, const double* left, const double* right, double weight,
                     double* sum, Index stride) {
  add_tile<2>(depth, left, right, weight, sum, stride);
}

#ifdef __x86_64__
[[gnu::target("avx2")]] void add_tile_by_four(Index depth, const double* left, const double* right,
                                              double weight, double* sum, Index stride) {
  add_tile<4>(depth, left, right, weight, sum, stride);
}

[[gnu::target("avx512f")]] void add_tile_by_eight(Index depth, const double* left,
                                                  const double* right, double weight, double* sum,
                                                  Index stride) {
  add_tile<8>(depth, left, right, weight, sum, stride);
}
#endif

/// Panels of `size` rows of a factor from `first` on, `depth` of its columns from `from` on, zeros beyond its end.
template <Index size>
void pack(const Factor& factor, Index first, Index behind, Index from, Index depth,
          std::vector<double>& panels) {
  panels.resize(static_cast<std::size_t>((behind - first + size - 1) / size * size * depth));
  double* to = panels.data();
  for (Index row = first; row < behind; row += size) {
    const Index count = std::min(size, behind - row);
    const double* at = factor.at + row * factor.row_stride + from * factor.column_stride;
    for (Index k = 0; k < depth; ++k, to += size, at += factor.column_stride) {
      if (count == size && factor.row_stride == 1) {
        std::memcpy(to, at, size * sizeof(double));
      } else if (count == size) {
#pragma GCC unroll 16
        for (Index r = 0; r < size; ++r) to[r] = at[r * factor.row_stride];
      } else {
        for (Index r = 0; r < count; ++r) to[r] = at[r * factor.row_stride];
        std::fill(to + count, to + size, 0.0);
      }
    }
  }
}

/// Adds what of a tile at (row, column) lies within the result, or within its lower triangle.
void add_part(const std::array<double, kTileRows * kTileColumns>& tile, Index row, Index column,
              bool lower, SumOfProducts& sum) {
  for (Index c = column; c < std::min(column + kTileColumns, sum.cols()); ++c)
    for (Index r = lower ? std::max(row, c) : row; r < std::min(row + kTileRows, sum.rows()); ++r)
      sum(r, c) += tile[static_cast<std::size_t>((c - column) * kTileRows + r - row)];
}

/// sum += weight left right', of factors with rows of the same length.
void add(double weight, const Factor& left, const Factor& right, bool lower, SumOfProducts& sum) {
  static const TileSum add_tile_to = tile_sums().front();
  thread_local std::vector<double> left_panels, right_panels;
  for (Index from = 0; from < left.columns; from += kProductDepth) {
    const Index depth = std::min(kProductDepth, left.columns - from);
    pack<kTileColumns>(right, 0, right.rows, from, depth, right_panels);
    for (Index first = 0; first < left.rows; first += kBlockRows) {
      const Index behind = std::min(first + kBlockRows, left.rows);
      pack<kTileRows>(left, first, behind, from, depth, left_panels);
      for (Index column = 0; column < right.rows; column += kTileColumns)
        for (Index row = first; row < behind; row += kTileRows) {
          if (lower && row + kTileRows <= column) continue;
          const double* of_left = left_panels.data() + (row - first) * depth;
          const double* of_right = right_panels.data() + column * depth;
          const bool whole = row + kTileRows <= sum.rows() && column + kTileColumns <= sum.cols();
          if (whole && !(lower && row < column + kTileColumns - 1)) {
            add_tile_to(depth, of_left, of_right, weight,
                        sum.data() + row + column * sum.outerStride(), sum.outerStride());
            continue;
          }
          std::array<double, kTileRows* kTileColumns> tile = {};
          add_tile_to(depth, of_left, of_right, weight, tile.data(), kTileRows);
          add_part(tile, row, column, lower, sum);
        }
    }
  }
}

Factor transposed(Factor factor) {
  std::swap(factor.rows, factor.columns);
  std::swap(factor.row_stride, factor.column_stride);
  return factor;
}

}  // namespace

void add_product(double weight, const Factor& a, const Factor& b, SumOfProducts sum) {
  add(weight, a, transposed(b), false, sum);
}

void add_square(double weight, const Factor& a, SumOfProducts sum) { add(weight, a, a, true, sum); }

std::vector<TileSum> tile_sums() {
  std::vector<TileSum> sums;
#ifdef __x86_64__
  if (__builtin_cpu_supports("avx512f")) sums.push_back(add_tile_by_eight);
  if (__builtin_cpu_supports("avx2")) sums.push_back(add_tile_by_four);
#endif
  sums.push_back(add_tile_by_two);
  return sums;
}

}  // namespace cellcal::calib
