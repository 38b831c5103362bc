#pragma once
// Touches in chronological order, and a session split at a change.

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "calib/estimate/problem.h"
#include "calib/estimate/solve.h"
#include "calib/model/kinematics.h"
#include "calib/model/linear.h"
#include "calib/model/robot.h"
#include "calib/model/touch.h"
#include "calib/model/units.h"
#include "calib/result/calibration.h"

namespace cellcal::calib {

/// Touches in the order in which they were made: by time if all state one (ties as given),
/// otherwise as given.
std::vector<std::size_t> in_order(std::span<const Touch> touches);
/// Adds "rank" of one touch in in_order(), counted from 1, unless that is the order given.
void add_rank(std::span<const Touch> touches, std::size_t index, std::vector<Quantity>& evidence);

/// A share of more than `most` touches in their order, equally of each target's fit and check
/// touches; indices, ascending.
std::vector<std::size_t> share_of(std::span<const Touch> touches, std::size_t most);

/// True if a move of a target of this kind is measurable as the distance of two places of it. A plane
/// shows its move along the normal alone.
constexpr bool has_two_places(TargetKind kind) { return kind != TargetKind::kPlane; }

/// A session with a target that moved after one of its touches, as one of two targets: the later
/// one within `sigma_m` of `centre_m`, or anywhere.
struct TwoPlaces {
  Cell cell;
  std::vector<Touch> touches;
  std::string later;  ///< id of the later one
};
TwoPlaces as_two(const Cell& cell, const std::vector<Touch>& touches, const std::string& target,
                 std::size_t after_touch, const std::optional<Eigen::Vector3d>& centre_m = {},
                 double sigma_m = 0.0);

// All fit touches of a session in their order, linearised at the result of a calibration of them,
// and the effect of a jump of a joint's zero, of the tool's tip or of a target between them
// (jump.h).

/// Prior 1 sigma of a jump: of a joint's zero; of tool and target in each direction.
inline constexpr double kUsualSlipRad = 0.1 * kRadPerDeg;
inline constexpr double kUsualKnockM = 1e-3;
/// Minimum number of touches on either side of a jump: three for a target's place, and two more.
inline constexpr std::size_t kLeastEachSide = 5;

/// Derivatives of the touch's whitened rows by jumps: of each joint's zero, then of the tool's tip
/// along the flange's axes. SI.
using JumpRows = Eigen::Matrix<double, Problem::kMostRows, Eigen::Dynamic>;
int jump_columns(const Problem& problem);
void by_jumps(const Problem& problem, const Problem::At& at, std::size_t touch, JumpRows& rows);

/// A possible jump, and its columns.
struct JumpSuspect {
  Jump::What what = Jump::What::kJoint;
  std::string name;
  std::size_t index = 0;  ///< of the joint or target
  Eigen::Index first = 0;
  Eigen::Index size = 1;
  double usual = 0.0;
  int unknown = -1;  ///< first unknown of a target
};

/// The jump of one suspect by `size`, from a touch of the sequence on.
struct FoundJump {
  std::size_t behind = 0;
  Eigen::VectorXd size;
  Eigen::MatrixXd information;  ///< of the jump, with all other unknowns free
  double squared_sigmas = 0.0;
};

/// Refers to the touches, and to itself.
class JumpSequence {
 public:
  JumpSequence(const Cell& cell, const std::vector<Touch>& touches, const Calibration& c);
  JumpSequence(const JumpSequence&) = delete;
  JumpSequence& operator=(const JumpSequence&) = delete;

  const Problem& problem() const { return problem_; }
  const std::vector<std::size_t>& order() const { return order_; }
  const std::vector<JumpSuspect>& suspects() const { return suspects_; }

  /// Place and size of the jump, if any. Robust: gross errors have no weight in the end, but are
  /// undecided at first, as is the place.
  std::optional<FoundJump> robust(const JumpSuspect& suspect) const;
  /// A further jump at a known place, by touches within the gate.
  std::optional<FoundJump> at(const JumpSuspect& suspect, std::size_t behind) const;
  /// Best place of the jump, given the jump removed from the touches after its first place.
  std::size_t placed(const JumpSuspect& suspect, const FoundJump& found) const;

 private:
  void set_prior(const Calibration& c, const Eigen::VectorXd& u);
  void fill_columns(const Eigen::VectorXd& x);
  /// Median of |r| relative to its value for normal errors.
  double scatter(const Eigen::VectorXd& residual) const;
  /// Geman and McClure's: full for inliers, none for gross errors.
  Eigen::VectorXd weights(const Eigen::VectorXd& residual, double width) const;
  /// With these weights: the place where the jump reduces the residuals most, or `only` that, and
  /// the remaining residuals.
  std::optional<FoundJump> best_place(const JumpSuspect& suspect, const Eigen::VectorXd& weight,
                                      std::optional<std::size_t> only,
                                      Eigen::VectorXd& residual) const;

  Cell levelled_;
  ArmModel arm_;
  Problem problem_;
  Linearisation linear_;
  Eigen::MatrixXd information_;  ///< from priors and certified lengths
  Eigen::VectorXd gradient_;
  Eigen::MatrixXd by_jump_;
  std::vector<JumpSuspect> suspects_;
  std::vector<std::size_t> order_;
  std::vector<int> row_;
};

// Information of the touches from one of a session on about a change before it: of a target's
// place, a joint's zero or the tool's tip. The score test: from a linearisation, without another
// solution.

/// Sums over whitened rows, added from a session's last touch backwards, so that common parts are
/// summed once: J_d are the columns of the change, J those of all unknowns, r the residuals.
template <int Columns = Eigen::Dynamic>
struct ChangeScore {
  using Square = Eigen::Matrix<double, Columns, Columns>;
  using Vector = Eigen::Matrix<double, Columns, 1>;
  using ByAll = Eigen::Matrix<double, Eigen::Dynamic, Columns>;

  explicit ChangeScore(Eigen::Index unknowns, Eigen::Index columns = Columns)
      : square(Square::Zero(columns, columns)),
        by_all(ByAll::Zero(unknowns, columns)),
        gradient(Vector::Zero(columns)) {}

  /// Some rows of J_d, J and r; r of a single row may be a number. Several rows at once are summed
  /// first, which rounds differently from one by one.
  void add(const auto& by_change, const auto& by_unknowns, const auto& residual,
           double weight = 1.0) {
    square.noalias() += (weight * by_change).transpose() * by_change;
    by_all.noalias() += (weight * by_unknowns).transpose() * by_change;
    gradient.noalias() += by_change.transpose() * (weight * residual);
  }

  Square square;    ///< J_d'J_d
  ByAll by_all;     ///< J'J_d
  Vector gradient;  ///< J_d'r
};

/// Squared sigmas by which a change improves the fit: from its information, all other unknowns
/// free, its gradient, and its prior 1 sigma. 0 without information.
template <int Columns>
double squared_sigmas(Eigen::Matrix<double, Columns, Columns> information,
                      const Eigen::Matrix<double, Columns, 1>& gradient, double usual) {
  information.diagonal().array() += 1.0 / (usual * usual);
  return inverse_square(information, gradient);  // (50)
}

}  // namespace cellcal::calib
