#pragma once
// Kinematics of the arm as known to a controller: forward and inverse for the TCP.

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "sim/krc/rsi_channel.h"

namespace cellcal::calib {
struct Cell;
}

namespace cellcal::sim {

/// POSCORR's RefCorrSys: the frame that X Y Z A B C of a correction refer to.
enum class CorrectionFrame { kBase, kTool };

class CartesianArm {
 public:
  virtual ~CartesianArm() = default;
  /// TCP in the base, axis angles in radians, a linear unit's position, which is first, in metres.
  virtual KukaFrame frame(std::span<const double> axis_rad) const = 0;
  /// Axis angles, with the linear unit where it is in `near_rad`, near `near_rad` for this TCP; empty: out of reach or outside the axes' limits.
  virtual std::optional<std::vector<double>> axes(const KukaFrame& tcp,
                                                  const std::vector<double>& near_rad) const = 0;
  /// As above, for the pose at `start_rad` displaced by `correction`.
  virtual std::optional<std::vector<double>> corrected(
      std::span<const double> start_rad, const KukaFrame& correction, CorrectionFrame system,
      const std::vector<double>& near_rad) const = 0;
};

/// The nominal arm and tool of a cell; null unless it has six joints, or a linear unit and six.
/// Further axes of the controller are no part of it.
std::shared_ptr<const CartesianArm> make_cartesian_arm(const calib::Cell& cell);

}  // namespace cellcal::sim
