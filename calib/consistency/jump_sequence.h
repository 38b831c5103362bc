#pragma once
// All fit touches of a session in their order, linearised where a calibration of them ended, and
// what a jump of a joint's zero, of the tool's tip or of a target in between does to them (jump.h).

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "calib/model/kinematics.h"
#include "calib/model/units.h"
#include "calib/problem/problem.h"
#include "calib/problem/solve.h"
#include "calib/result/calibration.h"

namespace cellcal::calib {

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

}  // namespace cellcal::calib
