#include "calib/estimate/observability.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>

#include "calib/estimate/information.h"
#include "calib/model/linear.h"
#include "calib/model/product.h"

namespace cellcal::calib {

namespace {

/// A step of one tolerance that changes all measurements together by less than a thousandth of a
/// sigma counts as unobserved.
constexpr double kSeen = 1e-3;
/// Half of the digits: singular values are computed from their squares.
constexpr double kRounding = 1e-7;
/// Minimum information on each nuisance unknown, for its block to be invertible.
constexpr double kFlatDirection = 1e-3;

/// True for arm parameters of every model level: geometry, tool and bending.
bool is_geometry(ParameterKind kind) {
  return !is_compliance(kind) && !is_transmission(kind) && !is_by_evidence(kind) &&
         kind != ParameterKind::kPlay && kind != ParameterKind::kPositioner;
}

/// J'J of some columns, lower part; by blocks that fit into the cache.
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
    add_square(1.0, block, gram);
  }
  return gram;
}

/// A direction along which a step of one tolerance moves all touches together by less than this
/// many touch sigmas is weak: its estimate is the tolerance.
constexpr double kNoInformation = 0.3;
/// Upper limit of the tip motion, rms over the workspace with a rigid tool, along a frame
/// direction. (The last link's fourth combination tilts the tool and with it its bending: by a
/// fraction of a micrometre, but by more with a softer tool.)
constexpr double kUnmeasurableM = 1e-6;
/// Minimum information on each direction: far below that of the others.
constexpr double kFlat = 1e-3;
/// Maximum number of weak directions in the result.
constexpr std::size_t kWeakNamed = 3;
/// Shares below this, relative to the largest motion in metres, are omitted.
constexpr double kNamed = 0.05;

/// Reduced echelon form by columns with full pivoting: the same space with sparse basis vectors,
/// each of which is easy to describe. Arm parameters are preferred as pivots.
Eigen::MatrixXd sparse_basis(Eigen::MatrixXd n, int arm_size) {
  const Eigen::Index k = n.cols();
  for (Eigen::Index c = 0; c < k; ++c) {
    Eigen::Index pivot = 0, column = c;
    const auto arm = n.block(0, c, arm_size, k - c);
    const double best = arm.cwiseAbs().maxCoeff(&pivot, &column);
    column += c;
    if (best < 1e-6) {  // no arm parameter left
      n.rightCols(k - c).cwiseAbs().maxCoeff(&pivot, &column);
      column += c;
    }
    n.col(c).swap(n.col(column));
    n.col(c) /= n(pivot, c);
    for (Eigen::Index other = 0; other < k; ++other)
      if (other != c) n.col(other) -= n(pivot, other) * n.col(c);
  }
  for (Eigen::Index c = 0; c < k; ++c) n.col(c).normalize();
  return n;
}

/// Motion [m] of the tip (rms over the workspace) or of the target by one prior sigma of each
/// unknown. Sigmas alone are not comparable, since a target's sigma is the same for arms of any
/// size.
Eigen::VectorXd reach_of(const Problem& problem, const TipMoves& stiff) {
  const double root_of_tips = std::sqrt(static_cast<double>(stiff.tips_m.cols()));
  const double lever_m =
      stiff.tips_m.norm() / root_of_tips;  // of a target that turns: rms distance of the tips
  double fastest_m_s = 0.0;
  for (std::size_t t = 0; t < problem.touches().size(); ++t)
    fastest_m_s = std::max(fastest_m_s, std::abs(problem.closing_m_s(t)));
  Eigen::VectorXd reach(problem.size());
  for (int i = 0; i < problem.size(); ++i) {
    const Unknown& unknown = problem.unknowns()[i];
    reach[i] = i < problem.arm_size()  ? stiff.moves_m.col(i).norm() / root_of_tips
               : i == problem.delay()  ? unknown.scale * fastest_m_s
               : unknown.unit == "deg" ? unknown.scale * lever_m
                                       : unknown.scale;
  }
  return reach;
}

UnidentifiableDirection described(const Problem& problem, const Eigen::VectorXd& direction) {
  UnidentifiableDirection result;
  for (int i = 0; i < problem.size(); ++i)
    if (std::abs(direction[i]) > 1e-9)  // below: rounding of the elimination
      result.direction.emplace_back(problem.unknowns()[i].key, direction[i]);
  return result;
}

/// `moves_m`: motion of tip or target by each unknown's share in the direction.
UnidentifiableKind kind_of_frame(const Problem& problem, const Eigen::VectorXd& moves_m) {
  std::vector<ParameterKey> arm;
  bool targets_move = false;
  for (int i = 0; i < problem.size(); ++i) {
    if (moves_m[i] < kNamed * moves_m.maxCoeff()) continue;
    if (i < problem.arm_size())
      arm.push_back(problem.unknowns()[i].key);
    else
      targets_move = true;
  }
  // Independent of the targets: a plane across the base axis is invariant to this rotation.
  const Robot& robot = problem.cell().robot;
  const auto is_direction = [](const ParameterKey& key) {  // of travel: turns with the first joint
    return key.kind == ParameterKind::kGuide && key.harmonic == 0;
  };
  if (robot.first_turning() > 0 && arm.size() > 1 && targets_move) std::erase_if(arm, is_direction);
  if (arm.size() == 1 && arm.front().joint == static_cast<int>(robot.first_turning())) {
    if (arm.front().kind == ParameterKind::kTheta) return UnidentifiableKind::kZeroOfFirstJoint;
    if (arm.front().kind == ParameterKind::kD) return UnidentifiableKind::kHeightOfBase;
  }
  const int last = problem.arm().joint_count() - 1;
  const bool after_last = !targets_move && !arm.empty() &&
                          std::all_of(arm.begin(), arm.end(), [&](const ParameterKey& key) {
                            return key.joint == last || key.joint < 0;
                          });
  return after_last ? UnidentifiableKind::kBehindLastJoint : UnidentifiableKind::kNothingMoves;
}

UnidentifiableDirection frame_direction(const Problem& problem, const Eigen::VectorXd& direction,
                                        const Eigen::VectorXd& moves_m) {
  UnidentifiableDirection result = described(problem, direction);
  result.kind = kind_of_frame(problem, moves_m);
  constexpr std::size_t kMost = 8;
  for (int i = 0; i < problem.size(); ++i) {
    const ParameterKey& key = problem.unknowns()[i].key;
    if (moves_m[i] < kNamed * moves_m.maxCoeff()) continue;
    if (result.parameters.size() < kMost)
      result.parameters.push_back(key);
    else
      ++result.more_parameters;
  }
  return result;
}

/// True if all lengths grow together: the scale of the arm.
bool is_scale(const Problem& problem, const Eigen::VectorXd& direction) {
  double scale = 0.0, lengths = 0.0, all = 0.0;
  for (int i = 0; i < problem.arm_size(); ++i) {
    const ParameterKind kind = problem.arm().parameters()[i].kind;
    all += direction[i] * direction[i];
    if (kind == ParameterKind::kD || kind == ParameterKind::kA) {
      lengths += direction[i] * direction[i];
      const Joint& joint = problem.cell().robot.joints[problem.arm().parameters()[i].joint];
      scale += direction[i] * (kind == ParameterKind::kD ? joint.d_m : joint.a_m);
    }
  }
  double arm_length = 0.0;
  for (const Joint& joint : problem.cell().robot.joints)
    arm_length += joint.d_m * joint.d_m + joint.a_m * joint.a_m;
  return lengths > 0.7 * all && std::abs(scale) > 0.5 * std::sqrt(arm_length * all);
}

/// Description of a weak direction by its parameters, largest shares first.
UnidentifiableDirection weak_direction(const Problem& problem, const Eigen::VectorXd& direction,
                                       const Eigen::VectorXd& reach_m) {
  UnidentifiableDirection result = described(problem, direction);
  std::vector<int> order(problem.arm_size());
  for (int i = 0; i < problem.arm_size(); ++i) order[i] = i;
  std::sort(order.begin(), order.end(),
            [&](int a, int b) { return std::abs(direction[a]) > std::abs(direction[b]); });
  constexpr std::size_t kMost = 5;
  for (const int i : order)
    if (result.parameters.size() < kMost &&
        std::abs(direction[i]) > kNamed * std::abs(direction[order[0]]))
      result.parameters.push_back(problem.unknowns()[i].key);
  // For example the compliance of a joint that hardly bears a load.
  if (result.parameters.size() == 1 && reach_m[order[0]] < kUnmeasurableM)
    result.kind = UnidentifiableKind::kNoEffect;
  else
    result.kind = is_scale(problem, direction) && problem.fitted_lengths() == 0
                      ? UnidentifiableKind::kScale
                      : UnidentifiableKind::kWeak;
  return result;
}

/// Orthonormal directions of the rows' space and the change of the rows by a unit step along each,
/// weakest last. From the eigenvalues of the inverse information, the covariance with a flat prior:
/// its large eigenvalues are the small singular values of the rows, at full precision.
struct Weak {
  Eigen::MatrixXd directions;
  Eigen::VectorXd seen_by;
};

Weak weaker_than(double most, const Eigen::MatrixXd& triangle) {
  const Eigen::Index n = triangle.cols();
  Eigen::MatrixXd root = Eigen::MatrixXd::Identity(n, n);
  triangle.triangularView<Eigen::Upper>().solveInPlace(root);
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(n, n);
  add_square(1.0, root, covariance);
  const Eigenpairs pairs = eigenpairs(covariance);
  const auto seen_by = [&](Eigen::Index k) {
    return std::sqrt(std::max(0.0, 1.0 / pairs.values[k] - kFlat * kFlat));
  };
  Eigen::Index count = 0;
  while (count < n && seen_by(n - 1 - count) < most) ++count;
  Weak weak{pairs.vectors.rightCols(count), Eigen::VectorXd(count)};
  for (Eigen::Index k = 0; k < count; ++k) weak.seen_by[k] = seen_by(n - count + k);
  return weak;
}

/// Unknowns among which frame directions are sought: the geometry. Transmission errors are
/// excluded, since over a joint's range a constant and a slow wave are similar without being a
/// choice of frame; so are loads, many of which are moments that no joint bears.
std::vector<int> sought_in(const Problem& problem) {
  std::vector<int> sought;
  for (int i = 0; i < problem.size(); ++i) {
    const ParameterKind kind =
        i < problem.arm_size() ? problem.arm().parameters()[i].kind : ParameterKind::kTheta;
    if (!is_transmission(kind) && !is_by_evidence(kind) && kind != ParameterKind::kLoad &&
        kind != ParameterKind::kPlay)
      sought.push_back(i);
  }
  return sought;
}

/// Information of the touches on the unknowns `sought`. Every direction gets a minimum, so that the
/// information is invertible.
Information seen_by_touches(const Problem& problem, const Linearisation& linear,
                            const std::vector<int>& sought) {
  const auto width = static_cast<Eigen::Index>(sought.size());
  // Products of rows lose half the digits, in which the minimum information would vanish if rows
  // have large weights.
  constexpr double kLargestSquare = 1e9;
  double square = 0.0;
  for (const int i : sought) square = std::max(square, linear.jacobian.col(i).squaredNorm());
  Information measured(width, square > kLargestSquare);
  Eigen::VectorXd flat = Eigen::VectorXd::Constant(width, kFlat);
  for (Eigen::Index k = 0; k < width; ++k)
    if (problem.unknowns()[sought[static_cast<std::size_t>(k)]].held_by_geometry) flat[k] = 1.0;
  measured.add_alone(flat, Eigen::VectorXd::Zero(width));
  constexpr Eigen::Index kRows = 256;
  for (Eigen::Index first = 0; first < linear.jacobian.rows(); first += kRows) {
    const Eigen::Index rows = std::min(kRows, linear.jacobian.rows() - first);
    RowMajor block = RowMajor::Zero(rows, width + 1);
    for (Eigen::Index k = 0; k < width; ++k)
      block.col(k) = linear.jacobian.col(sought[static_cast<std::size_t>(k)]).segment(first, rows);
    measured.add(block);
  }
  return measured;
}

/// Adds the workspace as if each tip were measured to kUnmeasurableM: an unobserved direction is
/// one of frame only if it moves no tip of the workspace either.
void add_workspace(const Problem& problem, const Eigen::MatrixXd& moves_m,
                   const std::vector<int>& sought, Information& measured) {
  const auto width = static_cast<Eigen::Index>(sought.size());
  const auto tips = static_cast<double>(std::max<Eigen::Index>(1, moves_m.rows() / 3));
  RowMajor moves = RowMajor::Zero(moves_m.rows(), width + 1);
  for (Eigen::Index k = 0; k < width; ++k)
    if (const int i = sought[static_cast<std::size_t>(k)]; i < moves_m.cols())
      moves.col(k) = moves_m.col(i) / (kUnmeasurableM * std::sqrt(tips));
  measured.add(moves);
  // The compliance of a joint that hardly bears a load moves no tip either, but is no frame.
  Eigen::VectorXd gives = Eigen::VectorXd::Zero(width);
  for (Eigen::Index k = 0; k < width; ++k) {
    const int i = sought[static_cast<std::size_t>(k)];
    if (i >= problem.arm_size()) continue;
    const ParameterKind kind = problem.arm().parameters()[i].kind;
    if (kind == ParameterKind::kCompliance || kind == ParameterKind::kDeflection) gives[k] = 1.0;
  }
  measured.add_alone(gives, Eigen::VectorXd::Zero(width));
}

/// Directions with less than half a unit of information in the triangle. They are close to those
/// that the touches observe weakly: two inverse iterations from there remove the others.
Eigen::MatrixXd seen_nowhere(const Eigen::MatrixXd& triangle, Eigen::MatrixXd nearly) {
  constexpr double kNowhere = 0.5;
  constexpr int kIterations = 2;
  const auto upper = triangle.triangularView<Eigen::Upper>();
  for (int k = 0; k < kIterations; ++k) {
    upper.transpose().solveInPlace(nearly);
    upper.solveInPlace(nearly);
    nearly = orthonormal(nearly);
  }
  const Eigen::MatrixXd seen = upper * nearly;  // (35)
  const Eigenpairs pairs = eigenpairs(seen.transpose() * seen);
  Eigen::Index nowhere = 0;  // eigenvalues in ascending order
  while (nowhere < nearly.cols() && pairs.values[nowhere] < kNowhere * kNowhere) ++nowhere;
  return nearly * pairs.vectors.leftCols(nowhere);
}

/// Adds the weak directions, frame directions excluded, weakest first.
void name_weak(const Problem& problem, const Eigen::MatrixXd& directions,
               const Eigen::VectorXd& seen_by, const Eigen::VectorXd& reach_m,
               FrameDirections& result) {
  std::size_t named = 0;
  for (Eigen::Index k = directions.cols() - 1; k >= 0 && seen_by[k] < kNoInformation; --k) {
    Eigen::VectorXd v = directions.col(k);
    v -= result.basis_u * (result.basis_u.transpose() * v);
    if (v.norm() < 0.5) continue;
    if (++named > kWeakNamed) continue;
    v.normalize();
    result.named.push_back(weak_direction(problem, v, reach_m));
  }
  if (named > kWeakNamed) result.named.back().more_as_weak = named - kWeakNamed;
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
  std::vector<int> columns;  // geometry, then nuisances: positioner, target positions and radii
  for (int i = 0; i < problem.arm_size(); ++i)
    if (is_geometry(problem.arm().parameters()[static_cast<std::size_t>(i)].kind))
      columns.push_back(i);
  const auto geometry = static_cast<Eigen::Index>(columns.size());
  const auto is_positioners = [&](int i) {
    return i < problem.arm_size() && problem.arm().parameters()[static_cast<std::size_t>(i)].kind ==
                                         ParameterKind::kPositioner;
  };
  for (int i = 0; i < problem.size(); ++i)
    if (i >= problem.arm_size() || is_positioners(i)) columns.push_back(i);
  const Eigen::Index nuisances = static_cast<Eigen::Index>(columns.size()) - geometry;

  const Eigen::MatrixXd gram = gram_of(linear.jacobian, columns);
  Eigen::MatrixXd nuisance = gram.bottomRightCorner(nuisances, nuisances);
  for (Eigen::Index k = 0; k < nuisances; ++k) {
    const int i = columns[static_cast<std::size_t>(geometry + k)];
    nuisance(k, k) +=
        is_positioners(i) || problem.unknowns()[static_cast<std::size_t>(i)].held_by_geometry
            ? 1.0
            : kFlatDirection * kFlatDirection;  // in its own prior sigmas
  }
  Eigen::MatrixXd coupling = gram.bottomLeftCorner(nuisances, geometry);
  coupling = Cholesky(nuisance).whitened(coupling);
  Eigen::MatrixXd left = gram.topLeftCorner(geometry, geometry).selfadjointView<Eigen::Lower>();
  add_product(-1.0, coupling.transpose(), coupling, left);  // (42)

  // The frame directions' rows of the geometry span the subspace to be removed.
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
  // At most as many directions as rows are observable; the rest is rounding.
  std::sort(singular.begin(), singular.end(), std::greater<>());
  const auto rows = static_cast<std::size_t>(linear.jacobian.rows());
  for (std::size_t k = rows; k < singular.size(); ++k) singular[k] = 0.0;
  Observability result = indices_of(singular, static_cast<int>(rows));
  result.unknowns = problem.size();
  return result;
}

FrameDirections find_frame_directions(const Problem& problem, const Linearisation& linear,
                                      const TipMoves& stiff, const Eigen::MatrixXd& moves_m) {
  const std::vector<int> sought = sought_in(problem);
  const auto width = static_cast<Eigen::Index>(sought.size());
  const auto among_all = [&](const Eigen::MatrixXd& directions) {
    Eigen::MatrixXd all = Eigen::MatrixXd::Zero(problem.size(), directions.cols());
    for (Eigen::Index k = 0; k < width; ++k)
      all.row(sought[static_cast<std::size_t>(k)]) = directions.row(k);
    return all;
  };
  FrameDirections result;
  result.basis_u = Eigen::MatrixXd(problem.size(), 0);
  Information measured = seen_by_touches(problem, linear, sought);
  const Weak weak = weaker_than(1.0, measured.triangle().topLeftCorner(width, width));
  if (weak.seen_by.size() == 0) return result;
  add_workspace(problem, moves_m, sought, measured);
  result.basis_u =
      among_all(seen_nowhere(measured.triangle().topLeftCorner(width, width), weak.directions));
  const Eigen::VectorXd reach_m = reach_of(problem, stiff);
  if (result.basis_u.cols() > 0) {
    const Eigen::MatrixXd sparse = sparse_basis(result.basis_u, problem.arm_size());
    for (Eigen::Index c = 0; c < sparse.cols(); ++c)
      result.named.push_back(
          frame_direction(problem, sparse.col(c), reach_m.cwiseProduct(sparse.col(c).cwiseAbs())));
  }
  name_weak(problem, among_all(weak.directions), weak.seen_by, reach_m, result);
  return result;
}

}  // namespace cellcal::calib
