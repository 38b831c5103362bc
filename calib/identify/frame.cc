#include "calib/identify/frame.h"

#include <Eigen/QR>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

namespace cellcal::calib {

namespace {

/// A direction along which one tolerance sigma moves all touches together by less than this many
/// touch sigmas: whatever is said about it, the tolerances say it.
constexpr double kNoInformation = 0.3;
/// A frame direction moves nothing that anyone could measure: less than this, rms over the
/// workspace. (The last link's fourth combination is not exactly null: it tilts the tool and with
/// it its bending, by a fraction of a micrometre.)
constexpr double kUnmeasurableM = 1e-6;
/// At most this many weak directions are put into words.
constexpr std::size_t kWeakNamed = 3;
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
    if (i < problem.arm_size())
      arm_named.push_back(i);
    else
      targets_move = true;
  }
  const auto& first = joints.front().name;
  if (targets_move && arm_named.size() == 1 && parameters[arm_named[0]].joint == 0) {
    if (parameters[arm_named[0]].kind == ArmParameterKind::kTheta)
      return "turning the zero of " + first +
             " is the same as turning all targets about the base "
             "axis; fixed by convention";
    if (parameters[arm_named[0]].kind == ArmParameterKind::kD)
      return "raising the arm on its base (" + first +
             ".d) is the same as lowering all targets; "
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
    return "behind the last axis " + list(names) +
           " move the tip in three directions only: one "
           "combination of them never shows; fixed by convention";
  return list(names) + " can change together without anything moving; fixed by convention";
}

/// In words: what the weak direction is made of, and what would resolve it.
std::string weak_words(const Problem& problem, const Eigen::VectorXd& direction) {
  std::vector<int> order(problem.arm_size());
  for (int i = 0; i < problem.arm_size(); ++i) order[i] = i;
  std::sort(order.begin(), order.end(),
            [&](int a, int b) { return std::abs(direction[a]) > std::abs(direction[b]); });
  // Lengths that grow together: the scale of the arm.
  double scale = 0.0, lengths = 0.0, all = 0.0;
  for (int i = 0; i < problem.arm_size(); ++i) {
    const ArmParameterKind kind = problem.arm().parameters()[i].kind;
    all += direction[i] * direction[i];
    if (kind == ArmParameterKind::kD || kind == ArmParameterKind::kA) {
      lengths += direction[i] * direction[i];
      const Joint& joint = problem.cell().robot.joints[problem.arm().parameters()[i].joint];
      scale += direction[i] * (kind == ArmParameterKind::kD ? joint.d_m : joint.a_m);
    }
  }
  std::vector<std::string> names;
  constexpr std::size_t kNames = 5;
  for (const int i : order)
    if (names.size() < kNames && std::abs(direction[i]) > kNamed * std::abs(direction[order[0]]))
      names.push_back(problem.arm().parameters()[i].name);
  double arm_length = 0.0;
  for (const Joint& joint : problem.cell().robot.joints)
    arm_length += joint.d_m * joint.d_m + joint.a_m * joint.a_m;
  const bool is_scale = lengths > 0.7 * all && std::abs(scale) > 0.5 * std::sqrt(arm_length * all);
  std::string text = "these touches do not tell " + list(names) + " apart; the tolerances decide";
  if (is_scale && problem.lengths().empty())
    return text + ". All lengths grow together here: touch a second sphere at a certified distance";
  return text + ". Touches in other postures would resolve it";
}

}  // namespace

namespace {

/// Singular values and right vectors of a tall matrix, by way of its R.
Eigen::BDCSVD<Eigen::MatrixXd> decompose(const Eigen::MatrixXd& rows) {
  const Eigen::Index n = rows.cols();
  Eigen::MatrixXd tall = Eigen::MatrixXd::Zero(std::max(rows.rows(), n), n);
  tall.topRows(rows.rows()) = rows;
  const Eigen::HouseholderQR<Eigen::MatrixXd> qr(tall);
  const Eigen::MatrixXd r = qr.matrixQR().topRows(n).triangularView<Eigen::Upper>();
  return Eigen::BDCSVD<Eigen::MatrixXd>(r, Eigen::ComputeFullV);
}

UnidentifiableDirection described(const Problem& problem, const Eigen::VectorXd& direction,
                                  std::string words) {
  UnidentifiableDirection result;
  result.words = std::move(words);
  for (int i = 0; i < problem.size(); ++i)
    if (std::abs(direction[i]) > 1e-9)  // below: rounding of the elimination
      result.direction.emplace_back(problem.unknowns()[i].name, direction[i]);
  return result;
}

}  // namespace

FrameDirections find_frame_directions(const Problem& problem, const Linearisation& linear,
                                      const Eigen::MatrixXd& workspace_moves_m) {
  const int n = problem.size();
  std::vector<int> held;  // rows that are measurements though they stand as priors
  for (int i = 0; i < n; ++i)
    if (problem.unknowns()[i].held_by_geometry) held.push_back(i);
  // Frames are a matter of geometry. Transmission errors are left out of the search: over a joint's
  // range a constant and a slow wave are much alike, which is no choice of frame. So are loads:
  // many are moments that no joint bears.
  std::vector<int> wobble;
  for (int i = 0; i < problem.arm_size(); ++i) {
    const ArmParameterKind kind = problem.arm().parameters()[i].kind;
    if (kind == ArmParameterKind::kCosine || kind == ArmParameterKind::kSine ||
        kind == ArmParameterKind::kLoad)
      wobble.push_back(i);
  }
  const Eigen::Index touched = linear.jacobian.rows();
  const auto tips = static_cast<double>(std::max<Eigen::Index>(1, workspace_moves_m.rows() / 3));
  Eigen::MatrixXd measured =
      Eigen::MatrixXd::Zero(touched + static_cast<Eigen::Index>(held.size() + wobble.size()), n);
  measured.topRows(touched) = linear.jacobian;
  constexpr double kHeld = 1e3;  // a column that is seen for certain
  for (const int i : wobble) measured.col(i).setZero();
  for (std::size_t i = 0; i < held.size(); ++i)
    measured(touched + static_cast<Eigen::Index>(i), held[i]) = 1.0;
  for (std::size_t i = 0; i < wobble.size(); ++i)
    measured(touched + static_cast<Eigen::Index>(held.size() + i), wobble[i]) = kHeld;
  const auto seen = decompose(measured);

  // Touches and, as if they were measured to kUnmeasurableM, all tips of the workspace.
  Eigen::MatrixXd everything = Eigen::MatrixXd::Zero(measured.rows() + workspace_moves_m.rows(), n);
  everything.topRows(measured.rows()) = measured;
  everything.bottomLeftCorner(workspace_moves_m.rows(), workspace_moves_m.cols()) =
      workspace_moves_m / (kUnmeasurableM * std::sqrt(tips));
  for (const int i : wobble) everything.col(i).tail(workspace_moves_m.rows()).setZero();
  const auto anywhere = decompose(everything);
  int frame = 0;
  while (frame < n && anywhere.singularValues()[n - 1 - frame] < 0.5) ++frame;

  FrameDirections result;
  result.singular_values = seen.singularValues();
  result.basis_u = anywhere.matrixV().rightCols(frame);
  if (frame > 0) {
    const Eigen::MatrixXd sparse = sparse_basis(result.basis_u, problem.arm_size());
    for (int c = 0; c < frame; ++c)
      result.words.push_back(described(problem, sparse.col(c), words_for(problem, sparse.col(c))));
  }
  // What the touches do not see, frame aside: weakest first.
  std::size_t weak = 0;
  for (int k = n - 1; k >= 0 && seen.singularValues()[k] < kNoInformation; --k) {
    Eigen::VectorXd v = seen.matrixV().col(k);
    v -= result.basis_u * (result.basis_u.transpose() * v);
    if (v.norm() < 0.5) continue;
    if (++weak > kWeakNamed) continue;
    v.normalize();
    result.words.push_back(described(problem, v, weak_words(problem, v)));
  }
  if (weak > kWeakNamed)
    result.words.back().words +=
        "; " + std::to_string(weak - kWeakNamed) + " further directions are as weak";
  return result;
}

}  // namespace cellcal::calib
