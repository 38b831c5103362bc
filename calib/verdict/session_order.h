#pragma once
// Touches in the order in which they were made, and a session in two parts: before something in it
// changed, and after.

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

/// Touches in the order in which they were made: by time where all have one (and as given where it
/// is the same), else as given.
std::vector<std::size_t> in_order(std::span<const Touch> touches);

/// Of more than `most` touches a share in their order, of each target's fit and check touches
/// alike; indices, rising.
std::vector<std::size_t> share_of(std::span<const Touch> touches, std::size_t most);

/// An id for the same target after its move, which none of the cell's has.
std::string id_after_move(const Cell& cell, const std::string& id);

/// A session in which a target stands elsewhere behind one of its touches, as one of two targets:
/// the later one within `sigma_m` of `centre_m`, or anywhere.
struct TwoPlaces {
  Cell cell;
  std::vector<Touch> touches;
  std::string later;  ///< its id
};
TwoPlaces as_two(const Cell& cell, const std::vector<Touch>& touches, const std::string& target,
                 std::size_t after_touch, const std::optional<Eigen::Vector3d>& centre_m = {},
                 double sigma_m = 0.0);

// All fit touches of a session in their order, linearised where a calibration of them ended, and
// what a jump of a joint's zero, of the tool's tip or of a target in between does to them (jump.h).

/// Beyond this many sigmas a touch is left out, in the estimate too.
inline constexpr double kJumpGate = 4.0;
/// What is looked for, 1 sigma: of a joint's zero; of tool and target in each direction.
inline constexpr double kUsualSlipRad = 0.1 * kRadPerDeg;
inline constexpr double kUsualKnockM = 1e-3;
/// Touches on either side of a jump, at least: three for where a target is, and two more.
inline constexpr std::size_t kLeastEachSide = 5;

/// Columns by which a touch's whitened rows follow jumps: of each joint's zero, then of the tool's
/// tip along the flange's axes. SI.
using JumpRows = Eigen::Matrix<double, Problem::kMostRows, Eigen::Dynamic>;
int jump_columns(const Problem& problem);
void by_jumps(const Problem& problem, const Problem::At& at, std::size_t touch, JumpRows& rows);

/// One that may have jumped, and its columns.
struct JumpSuspect {
  Jump::What what = Jump::What::kJoint;
  std::string name;
  std::size_t index = 0;  ///< of the joint or target
  Eigen::Index first = 0;
  Eigen::Index size = 1;
  double usual = 0.0;
  int unknown = -1;  ///< of a target: its first
};

/// The jump of one suspect: by `size`, from touch `behind` of the sequence on.
struct FoundJump {
  std::size_t behind = 0;
  Eigen::VectorXd size;
  Eigen::MatrixXd information;  ///< of it, all else left free
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

  /// Where and by how much it jumped, if it did: touches far off count for nothing in the end, but
  /// which they are is left open at first, and so is where the jump was.
  std::optional<FoundJump> robust(const JumpSuspect& suspect) const;
  /// A further jump at a place that is known already, of touches that are within the gate.
  std::optional<FoundJump> at(const JumpSuspect& suspect, std::size_t behind) const;
  /// Where the jump, which these touches have undone from `behind` on, is placed best.
  std::size_t placed(const JumpSuspect& suspect, const FoundJump& found) const;

 private:
  void set_prior(const Calibration& c, const Eigen::VectorXd& u);
  void fill_columns(const Eigen::VectorXd& x);
  /// Median of |r| in what it is of normal ones.
  double scatter(const Eigen::VectorXd& residual) const;
  /// Geman and McClure's: full for honest touches, none for gross ones.
  Eigen::VectorXd weights(const Eigen::VectorXd& residual, double width) const;
  /// With each touch weighed so: the place where the jump takes most away, or `only` that, and what
  /// is left of the residuals then.
  std::optional<FoundJump> best_place(const JumpSuspect& suspect, const Eigen::VectorXd& weight,
                                      std::optional<std::size_t> only,
                                      Eigen::VectorXd& residual) const;

  Cell levelled_;
  ArmModel arm_;
  Problem problem_;
  Linearisation linear_;
  Eigen::MatrixXd information_;  ///< of priors and certified lengths
  Eigen::VectorXd gradient_;
  Eigen::MatrixXd by_jump_;
  std::vector<JumpSuspect> suspects_;
  std::vector<std::size_t> order_;
  std::vector<int> row_;
};

// What touches from one of a session on say of a change in front of it: of a target's place, a
// joint's zero or the tool's tip. The score test: from a linearisation, without solving anew.

/// Sums over whitened rows, added from a session's last touch back, so that what the later ones say
/// is summed up once: with J_d the columns of the change, J those of all unknowns, r the residuals.
template <int Columns = Eigen::Dynamic>
struct ChangeScore {
  using Square = Eigen::Matrix<double, Columns, Columns>;
  using Vector = Eigen::Matrix<double, Columns, 1>;
  using ByAll = Eigen::Matrix<double, Eigen::Dynamic, Columns>;

  explicit ChangeScore(Eigen::Index unknowns, Eigen::Index columns = Columns)
      : square(Square::Zero(columns, columns)),
        by_all(ByAll::Zero(unknowns, columns)),
        gradient(Vector::Zero(columns)) {}

  /// Some rows of J_d, J and r; one row's r may be a number. Several at once are summed among
  /// themselves first, which rounds otherwise than one after the other.
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

/// By how many squared sigmas a change improves the fit: with its information, all other unknowns
/// left free, its gradient, and what is looked for, 1 sigma. 0 where the information is none.
template <int Columns>
double squared_sigmas(Eigen::Matrix<double, Columns, Columns> information,
                      const Eigen::Matrix<double, Columns, 1>& gradient, double usual) {
  information.diagonal().array() += 1.0 / (usual * usual);
  return inverse_square(information, gradient);  // (50)
}

}  // namespace cellcal::calib
