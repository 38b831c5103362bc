#include "calib/identify/frame.h"

#include <Eigen/QR>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

namespace cellcal::calib {

namespace {

/// A direction along which one tolerance sigma moves all touches together by less than this many
/// touch sigmas carries no usable information; rounding is far below. (The last link's fourth
/// combination is not exactly null: it tilts the bending tool and so shows at 1e-3 to 1e-2.)
constexpr double kNoInformation = 0.05;
constexpr double kRounding = 1e-11;  // of the largest singular value
/// Shares below this are not worth naming.
constexpr double kNamed = 0.05;

/// Reduced echelon form by columns with full pivoting: the same space in sparse vectors, each of
/// which can be put into words. Arm parameters are preferred as pivots.
Eigen::MatrixXd sparse_basis(Eigen::MatrixXd n, int arm_size) {
  const Eigen::Index k = n.cols();
  for (Eigen::Index c = 0; c < k; ++c) {
    Eigen::Index pivot = 0, column = c;
    const auto arm = n.block(0, c, arm_size, k - c);
    const double best = arm.cwiseAbs().maxCoeff(&pivot, &column);
    column += c;
    if (best < 1e-6) {  // nothing of the arm left in it
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

std::string list(const std::vector<std::string>& names) {
  std::string text;
  for (std::size_t i = 0; i < names.size(); ++i)
    text += (i == 0 ? "" : i + 1 == names.size() ? " and " : ", ") + names[i];
  return text;
}

std::string words_for(const Problem& problem, const Eigen::VectorXd& direction) {
  const auto& joints = problem.cell().robot.joints;
  const auto& parameters = problem.arm().parameters();
  std::vector<int> arm_named;
  bool targets_move = false;
  for (int i = 0; i < problem.size(); ++i) {
    if (std::abs(direction[i]) < kNamed * direction.cwiseAbs().maxCoeff()) continue;
    if (i < problem.arm_size()) arm_named.push_back(i);
    else targets_move = true;
  }
  const auto& first = joints.front().name;
  if (targets_move && arm_named.size() == 1 && parameters[arm_named[0]].joint == 0) {
    if (parameters[arm_named[0]].kind == ArmParameterKind::kTheta)
      return "turning the zero of " + first + " is the same as turning all targets about the base "
             "axis; fixed by convention";
    if (parameters[arm_named[0]].kind == ArmParameterKind::kD)
      return "raising the arm on its base (" + first + ".d) is the same as lowering all targets; "
             "fixed by convention";
  }
  const int last = static_cast<int>(joints.size()) - 1;
  const bool last_link = !targets_move && !arm_named.empty() &&
                         std::all_of(arm_named.begin(), arm_named.end(), [&](int i) {
                           return parameters[i].joint == last || parameters[i].joint < 0;
                         });
  std::vector<std::string> names;
  for (int i = 0; i < problem.size(); ++i)
    if (std::abs(direction[i]) >= kNamed * direction.cwiseAbs().maxCoeff())
      names.push_back(problem.unknowns()[i].name);
  constexpr std::size_t kMaxNames = 8;
  if (names.size() > kMaxNames) {
    const std::string more = std::to_string(names.size() - kMaxNames) + " more";
    names.resize(kMaxNames);
    names.push_back(more);
  }
  if (last_link)
    return "behind the last axis " + list(names) + " move the tip in three directions only: one "
           "combination of them never shows; fixed by convention";
  return list(names) + " can change together without any touch noticing; the tolerances decide";
}

}  // namespace

FrameDirections find_frame_directions(const Problem& problem, const Linearisation& linear) {
  const int n = problem.size();
  // Rows that are measurements though they stand as priors: diameters and tip.
  std::vector<int> held;
  for (int i = 0; i < n; ++i)
    if (problem.unknowns()[i].held_by_geometry) held.push_back(i);
  const Eigen::Index rows = linear.jacobian.rows() + static_cast<Eigen::Index>(held.size());
  Eigen::MatrixXd measured = Eigen::MatrixXd::Zero(std::max<Eigen::Index>(rows, n), n);
  measured.topRows(linear.jacobian.rows()) = linear.jacobian;
  for (std::size_t i = 0; i < held.size(); ++i)
    measured(linear.jacobian.rows() + static_cast<Eigen::Index>(i), held[i]) = 1.0;
  // R of a QR has the same singular values and right vectors, at n x n.
  const Eigen::MatrixXd r =
      Eigen::HouseholderQR<Eigen::MatrixXd>(measured).matrixQR().topRows(n).triangularView<Eigen::Upper>();
  const Eigen::BDCSVD<Eigen::MatrixXd> svd(r, Eigen::ComputeFullV);
  const Eigen::VectorXd& s = svd.singularValues();
  const double threshold = std::max(kNoInformation, kRounding * s[0]);
  int null = 0;
  while (null < n && s[n - 1 - null] < threshold) ++null;

  FrameDirections result;
  result.singular_values = s.reverse();
  result.basis_u = svd.matrixV().rightCols(null);
  if (null == 0) return result;
  const Eigen::MatrixXd sparse = sparse_basis(result.basis_u, problem.arm_size());
  for (int c = 0; c < null; ++c) {
    UnidentifiableDirection direction;
    direction.words = words_for(problem, sparse.col(c));
    for (int i = 0; i < n; ++i)
      if (std::abs(sparse(i, c)) > 1e-9) // below: rounding of the elimination
        direction.direction.emplace_back(problem.unknowns()[i].name, sparse(i, c));
    result.words.push_back(std::move(direction));
  }
  return result;
}

}  // namespace cellcal::calib
