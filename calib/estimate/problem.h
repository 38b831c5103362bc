#pragma once
// The least-squares problem: which unknowns there are, what each touch and each certified length
// says about them, and with what weight. Everything is in prior units: an unknown u is
// (x - origin) / scale with its prior sigma as scale (a target's place: 10 mm, 10 mrad), and a
// residual is divided by its sigma. So
// the numbers that the solver and the decompositions see are pure, and 1 means 'one sigma'.

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <string>
#include <vector>

#include "calib/estimate/target.h"
#include "calib/model/kinematics.h"
#include "calib/model/touch.h"

namespace cellcal::calib {

struct Unknown {
  ParameterKey key;
  std::string unit;
  double to_unit = 1.0;
  double nominal = 0.0;  ///< as the files state it
  double origin = 0.0;   ///< value at u = 0
  double scale = 1.0;    ///< SI value of u = 1
  double prior_mean_u = 0.0;
  double prior_weight = 0.0;      ///< 1 / (prior sigma in u); 0: no prior
  bool held_by_geometry = false;  ///< its prior is a measurement (diameter, tip), not a tolerance
};

/// Where a target's own unknowns lie: its place (target_place.h), the deviation of a sphere's
/// radius, and how the probe of a tracker of poses is turned on the tool.
struct TargetBlock {
  static constexpr int kMost = 9;
  std::size_t target = 0;   ///< index into the cell
  int first = 0;            ///< index of the first in the unknowns
  int place = 3;            ///< how many say where it is
  bool has_radius = false;  ///< one more, the last
  bool has_turns = false;   ///< three more, the last
  int size() const { return place + (has_radius ? 1 : 0) + (has_turns ? 3 : 0); }
};

/// Throws IdentifyError. Holds references to cell and touches.
class Problem {
 public:
  /// `places`: start per target of the cell. Targets without a fit touch are left out.
  /// `ripple_rad`: joint noise beyond the touch noise, 1 sigma per joint.
  Problem(const Cell& cell, const ArmModel& arm, std::span<const Touch> touches,
          const std::vector<TargetPlace>& places, double ripple_rad = 0.0);

  /// More touches, of targets that have fit touches already; `touches` begins with those known.
  /// Throws IdentifyError where a target is new.
  void extend(std::span<const Touch> touches);

  const std::vector<Unknown>& unknowns() const { return unknowns_; }
  int size() const { return static_cast<int>(unknowns_.size()); }
  int arm_size() const { return arm_.size(); }
  /// Unknowns that every touch sees: the arm's, rho and the latch's delay; they come first.
  int shared_size() const { return shared_size_; }
  /// Index of a tool's effective radius, -1 where it is known.
  int rho(int tool = 0) const { return rho_[static_cast<std::size_t>(tool)]; }
  /// Index of the latch's delay, -1 where it is known or no fit touch states a speed.
  int delay() const { return delay_; }
  /// Whether a touch asks for the delay and there is none, as the first that states a speed.
  bool lacks_delay_of(const Touch& touch) const;
  /// How fast a touch went into its target's surface: what a second of delay does to its residual;
  /// 0 where no speed is stated or nothing has a surface.
  double closing_m_s(std::size_t touch) const { return closing_m_s_[touch]; }
  const std::vector<TargetBlock>& blocks() const { return blocks_; }
  /// Block of a touch's target, -1 where the target has no fit touch.
  int block_of(std::size_t touch) const { return block_of_[touch]; }
  /// From which a target's own unknowns count.
  const TargetPlace& place(const TargetBlock& block) const { return places_[block.target]; }

  static constexpr int kMostRows = 6;
  /// 1, or 3 for a point or a tracker; 6 where a tracker measured a pose: behind the place its
  /// turns, in metres by turn_lever_m().
  int rows(std::size_t touch) const;
  /// Those that are a distance.
  int place_rows(std::size_t touch) const { return std::min(rows(touch), 3); }
  /// Unknowns at which residuals are taken; refers to x.
  struct At {
    const double* x;
    ArmErrors arm;
    std::array<double, kMaxTools> rho_m;
    double delay_s;
  };
  At at(const double* x_si) const;
  /// Residual of a touch in metres. `by_shared` (rows x shared_size) and `by_target` (rows x block
  /// size) are derivatives by SI unknowns, row-major; null where not wanted. `direction`: unit,
  /// from the centre to the tip; of a plane its normal, of a tracker from where it saw the tip.
  void residual_m(std::size_t touch, const At& at, double* residual, double* by_shared,
                  double* by_target, Eigen::Vector3d* direction = nullptr) const;
  /// Touch noise with the joints' ripple in it.
  double sigma_m(std::size_t touch) const { return sigma_m_[touch]; }
  /// Metres per radian that make a turn's sigma the touch's: one sigma serves all rows, and ripple
  /// widens turns as it widens the place.
  double turn_lever_m(std::size_t touch) const;
  /// The same with another ripple.
  double sigma_m(std::size_t touch, double ripple_rad) const;
  /// Touch noise alone.
  double own_sigma_m(std::size_t touch) const { return own_sigma_m_[touch]; }
  /// An error of the arm beside the model, this much in each direction at every touch
  /// (discrepancy.h); the noise of all touches becomes `noise_factor` times what it was.
  void set_field(double field_m, double noise_factor);
  double field_m() const { return field_m_; }
  /// Another ripple from here on.
  void set_ripple(double ripple_rad);
  /// Touches that were made `times` times at one place share its ripple: their mean has one, so
  /// each counts as if its own were larger by the root of `times`. Those that state no sigma of
  /// their own get `sigma_m`, and so do those that come later. Replaces what was set before.
  void set_repeats(std::vector<int> times, double sigma_m);
  /// What one radian of independent noise in every joint does to the residual, root of squares;
  /// of repeats times the root of their number.
  double joint_lever_m(std::size_t touch) const {
    return lever_m_[touch] * std::sqrt(times_[touch]);
  }
  /// r_s + r_tip of a sphere, r_tip of a plane, without rho and without the sphere's own deviation.
  double nominal_radius_m(const Target& target, int tool) const;
  /// Index of the tool whose tip it was.
  int tool_of(std::size_t touch) const { return poses_[touch].tool; }

  struct Length {
    int block_a, block_b;
    double length_m, sigma_m;
  };
  const std::vector<Length>& lengths() const { return lengths_; }

  Eigen::VectorXd to_si(const Eigen::VectorXd& u) const;
  std::span<const Touch> touches() const { return touches_; }
  const Cell& cell() const { return cell_; }
  const ArmModel& arm() const { return arm_; }
  const PreparedPose& pose(std::size_t touch) const { return poses_[touch]; }

 private:
  const Cell& cell_;
  const ArmModel& arm_;
  std::span<const Touch> touches_;
  std::vector<PreparedPose> poses_;
  std::vector<TargetResidual> residuals_;
  std::vector<TargetPlace> places_;
  ArmErrors nominal_;
  std::vector<Unknown> unknowns_;
  std::vector<TargetBlock> blocks_;
  std::vector<int> block_of_;
  std::vector<std::size_t> target_of_;
  std::vector<double> own_sigma_m_, sigma_m_, lever_m_, closing_m_s_;
  std::vector<int> times_;  ///< touches at the place of each, itself included
  double usual_sigma_m_;    ///< of touches that state none
  std::vector<Length> lengths_;
  std::vector<int> block_of_target_;
  double ripple_rad_ = 0.0;
  double field_m_ = 0.0;
  int shared_size_ = 0;
  std::vector<int> rho_;  ///< per tool
  int delay_ = -1;
  void add_rho();
  void add_delay();
  /// Where residuals and derivatives of a touch go, as residual_m() has them.
  struct Rows {
    double *residual, *by_shared, *by_target;
    Eigen::Vector3d* direction;
  };
  /// Of kinds that measure a distance.
  template <typename Kind>
  requires requires(Kind kind) { kind.has_own_radius; }
  void fill(const Kind& kind, std::size_t touch, const At& at, const ArmChain& chain,
            const Rows& rows) const;
  /// Of kinds that say where the tip is.
  template <typename Kind>
  requires requires(Kind kind) { kind.has_turns; }
  void fill(const Kind& kind, std::size_t touch, const At& at, const ArmChain& chain,
            const Rows& rows) const;
  void fill_turn(const TrackerResidual& kind, std::size_t touch, const At& at,
                 const ArmChain& chain, const Rows& rows) const;
  void add_target(std::size_t target);
  void add_lengths();
  void weigh(std::size_t touch);
  void weigh_from(std::size_t first);
  void resize(std::size_t count);
};

}  // namespace cellcal::calib
