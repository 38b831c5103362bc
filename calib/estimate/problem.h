#pragma once
// The least-squares problem: the unknowns, and the residual and weight of each touch and each
// certified length. Everything is in prior units: an unknown u is (x - origin) / scale with its
// prior sigma as scale (a target's place: 10 mm, 10 mrad), and a residual is divided by its sigma.
// Solver and decompositions thus use dimensionless numbers in which 1 means one sigma.

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
  double nominal = 0.0;  ///< value in the robot or cell file
  double origin = 0.0;   ///< value at u = 0
  double scale = 1.0;    ///< SI value of u = 1
  double prior_mean_u = 0.0;
  double prior_weight = 0.0;      ///< 1 / (prior sigma in u); 0: no prior
  bool held_by_geometry = false;  ///< the prior is a measurement (diameter, tip), not a tolerance
};

/// Unknowns of a target: its place (target.h), the deviation of a sphere's radius, and the rotation
/// of a pose tracker's probe on the tool.
struct TargetBlock {
  static constexpr int kMost = 9;
  std::size_t target = 0;   ///< index into the cell
  int first = 0;            ///< index of the first in the unknowns
  int place = 3;            ///< number of unknowns of the place
  bool has_radius = false;  ///< one more unknown, the last
  bool has_turns = false;   ///< three more unknowns, the last
  int size() const { return place + (has_radius ? 1 : 0) + (has_turns ? 3 : 0); }
};

/// Least-squares problem of a cell. Throws IdentifyError. Holds references to cell and touches.
class Problem {
 public:
  /// `places`: start of each target of the cell. Targets without fit touches are omitted.
  /// `ripple_rad`: joint noise beyond the touch noise, 1 sigma per joint.
  Problem(const Cell& cell, const ArmModel& arm, std::span<const Touch> touches,
          const std::vector<TargetPlace>& places, double ripple_rad = 0.0);

  /// Adds touches of targets that already have fit touches; `touches` begins with the known ones.
  /// Throws IdentifyError for a new target.
  void extend(std::span<const Touch> touches);

  const std::vector<Unknown>& unknowns() const { return unknowns_; }
  int size() const { return static_cast<int>(unknowns_.size()); }
  int arm_size() const { return arm_.size(); }
  /// Number of unknowns common to all touches: arm, rho and latch delay; they come first.
  int shared_size() const { return shared_size_; }
  /// Index of a tool's effective radius, -1 if it is known.
  int rho(int tool = 0) const { return rho_[static_cast<std::size_t>(tool)]; }
  /// Index of the latch delay, -1 if it is known or no fit touch states a speed.
  int delay() const { return delay_; }
  /// True if `touch` requires the delay as an unknown and the problem lacks it: the first fit touch
  /// on a surface that states a speed.
  bool lacks_delay_of(const Touch& touch) const;
  /// Contact speed normal to the target's surface, the residual per second of delay; 0 without a
  /// stated speed or without a surface.
  double closing_m_s(std::size_t touch) const { return closing_m_s_[touch]; }
  const std::vector<TargetBlock>& blocks() const { return blocks_; }
  /// Block of a touch's target, -1 if the target has no fit touch.
  int block_of(std::size_t touch) const { return block_of_[touch]; }
  /// Origin of a target's own unknowns.
  const TargetPlace& place(const TargetBlock& block) const { return places_[block.target]; }

  static constexpr int kMostRows = 6;
  /// Number of rows: 1; 3 for a point or a tracker; 6 if a tracker measured a pose: position, then
  /// rotation, in metres by turn_lever_m().
  int rows(std::size_t touch) const;
  /// Number of rows that are distances.
  int place_rows(std::size_t touch) const { return std::min(rows(touch), 3); }
  /// Values of the unknowns at which residuals are evaluated; refers to x.
  struct At {
    const double* x;
    ArmErrors arm;
    std::array<double, kMaxTools> rho_m;
    double delay_s;
  };
  At at(const double* x_si) const;
  /// Residual of a touch in metres. `by_shared` (rows x shared_size) and `by_target` (rows x block
  /// size) are derivatives by SI unknowns, row-major; null if not needed. `direction`: unit vector
  /// from the centre to the tip; of a plane its normal, of a tracker from the measured tip
  /// position.
  void residual_m(std::size_t touch, const At& at, double* residual, double* by_shared,
                  double* by_target, Eigen::Vector3d* direction = nullptr) const;
  /// Sigma of a touch [m]: touch noise and the joints' ripple.
  double sigma_m(std::size_t touch) const { return sigma_m_[touch]; }
  /// Lever [m] by which rotation rows are multiplied, so that one sigma serves all rows of the
  /// touch and ripple widens rotations as it widens the position.
  double turn_lever_m(std::size_t touch) const;
  /// Sigma of a touch [m] with another ripple.
  double sigma_m(std::size_t touch, double ripple_rad) const;
  /// Touch noise alone [m].
  double own_sigma_m(std::size_t touch) const { return own_sigma_m_[touch]; }
  /// Sets the model discrepancy (discrepancy.h), 1 sigma per component at every touch, and scales
  /// the noise of all touches by `noise_factor`.
  void set_field(double field_m, double noise_factor);
  double field_m() const { return field_m_; }
  /// Replaces the ripple.
  void set_ripple(double ripple_rad);
  /// Sets repeats. `times[i]`: number of touches at the posture of touch i. They share the ripple, so
  /// that their mean has that of one: each counts as if its ripple were larger by the root of the
  /// number. `first[i]`: the first touch of the same place. Replaces previous repeats. `sigma_m`: as in
  /// set_noise().
  void set_repeats(std::vector<int> times, std::vector<std::size_t> first, double sigma_m);
  /// The first touch that repeats the same place; the touch itself without repeats.
  std::size_t first_of_place(std::size_t touch) const { return first_[touch]; }
  /// Noise of the touches that state none, later ones included.
  void set_noise(double sigma_m);
  /// Change of the residual [m] by one radian of independent noise in every joint, root sum of
  /// squares; of repeats, times the root of their number.
  double joint_lever_m(std::size_t touch) const {
    return lever_m_[touch] * std::sqrt(times_[touch]);
  }
  /// r_s + r_tip of a sphere, r_tip of a plane, without rho and without the deviation of the
  /// sphere.
  double nominal_radius_m(const Target& target, int tool) const;
  /// Index of the touch's tool.
  int tool_of(std::size_t touch) const { return poses_[touch].tool; }

  struct Length {
    int block_a, block_b;
    double length_m, sigma_m;
    bool is_check;  ///< its row has no weight
    /// Sigma of its row.
    double fit_sigma_m() const { return is_check ? kNoWeightM : sigma_m; }
    static constexpr double kNoWeightM = 1e3;
  };
  const std::vector<Length>& lengths() const { return lengths_; }
  int fitted_lengths() const {
    return static_cast<int>(std::ranges::count(lengths_, false, &Length::is_check));
  }

  Eigen::VectorXd to_si(const Eigen::VectorXd& u) const;
  /// Inverse of to_si().
  Eigen::VectorXd to_u(const Eigen::VectorXd& x) const;
  /// SI values of u = 1.
  Eigen::VectorXd scales() const;
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
  std::vector<int> times_;          ///< number of touches at the posture of each, itself included
  std::vector<std::size_t> first_;  ///< of the touches at the place of each
  double usual_sigma_m_;            ///< noise of touches that state none
  std::vector<Length> lengths_;
  std::vector<int> block_of_target_;
  double ripple_rad_ = 0.0;
  double field_m_ = 0.0;
  int shared_size_ = 0;
  std::vector<int> rho_;  ///< per tool
  int delay_ = -1;
  void add_rho();
  void add_delay();
  /// Destinations of the residuals and derivatives of a touch, as in residual_m().
  struct Rows {
    double *residual, *by_shared, *by_target;
    Eigen::Vector3d* direction;
  };
  void fill(const DistanceResidual& kind, std::size_t touch, const At& at, const ArmChain& chain,
            const Rows& rows) const;
  void fill(const PositionResidual& kind, std::size_t touch, const At& at, const ArmChain& chain,
            const Rows& rows) const;
  void fill_turn(const PositionResidual& kind, std::size_t touch, const At& at,
                 const ArmChain& chain, const Rows& rows) const;
  void add_target(std::size_t target);
  void add_lengths();
  void weigh(std::size_t touch);
  void weigh_from(std::size_t first);
  void resize(std::size_t count);
};

}  // namespace cellcal::calib
