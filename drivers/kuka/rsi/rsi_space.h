#pragma once
// Corrections in space (POSCORR, tag RKorr): conversion of commanded axis angles to the transmitted
// frame, and the resulting validation of moves.
//
// Model: the controller takes its nominal TCP at RSI_ON (start axes), shifts it by X, Y, Z and
// turns it by Rz(A) Ry(B) Rx(C), all in the frame of RefCorrSys, and solves for the axes. Base and
// RobRoot: shift along the root's axes, turn about the TCP, about axes parallel to the root's.
// Tool: the frame of the TCP at RSI_ON. Fails safe if that does not hold: the arm then deviates
// from the command, and the following-error monitor stops it.
//
// Rotations below 90 deg stay away from the transition of A or C from 180 to -180 deg, and from B =
// 90 deg, where A and C change rapidly. Above 90 deg this may occur; for a controller that composes
// them it is one rotation.
//
// Near a singularity a small step in space is a large one of axes, so a move may only pass where
// the gain of the arm's inverse is small (kMostGain).

#include <Eigen/Geometry>
#include <array>
#include <optional>
#include <span>

#include "drivers/kuka/moves/move_queue.h"
#include "drivers/kuka/rsi/rsi_config.h"
#include "drivers/kuka/rsi/rsi_report.h"
#include "drivers/kuka/wire/rsi_codec.h"

namespace cellcal::drivers {

/// Maximum rotation of any axis in radians per metre or radian of the TCP. A wrist reaches it 3.8
/// deg from A5 = 0, where the last transmitted decimal (1e-6 deg) is 1.5e-5 deg of an axis.
inline constexpr double kMostGain = 15.0;
/// The singularity check of object_to(), for planning moves without a session.
bool clear_of_singularities(const ArmGeometry& arm, const AxisAngles& from_rad,
                            const AxisAngles& to_rad);

class SpaceCorrector {
 public:
  /// `config` must outlive this object. No effect unless config.on.
  explicit SpaceCorrector(const SpaceCorrection& config) : config_(config) {}

  /// Sets the axes that corrections refer to: the pose at RSI_ON.
  void begin(const AxisAngles& start_rad);
  /// Frame that moves the TCP to that of the start axes plus `correction_deg`: X Y Z [mm], A B C
  /// [deg]. Empty: not finite.
  std::optional<KukaFrame> rkorr(std::span<const double> correction_deg) const;

  /// Checks the line from one axis correction to another [rad]: limits of shift and rotation,
  /// singularities. The start is the current position and is not checked.
  std::optional<Cause> object_to(const AxisAngles& from_rad, const AxisAngles& to_rad) const;

  /// RIst compared with the geometry at the axes of the same packet. Zero: nothing to compare.
  TcpApart apart(const RobFrame& frame, const AxisAngles& actual_rad) const;

 private:
  KukaFrame frame_at(const AxisAngles& axis_rad) const;

  const SpaceCorrection& config_;
  AxisAngles start_rad_;
  std::array<double, 12> start_{};  // its TCP: rotation columns, position; no Eigen in headers
};

// Geometry of the arm required for corrections in space: the TCP of the controller's own, nominal
// arm. Provided by the owner of the adapter.

class ArmGeometry {
 public:
  virtual ~ArmGeometry() = default;
  /// The active TCP of the controller, in the robot's root [m], at six axis angles. Called in the
  /// cycle: it must not allocate, lock or throw.
  virtual Eigen::Isometry3d tcp(std::span<const double> axis_rad) const noexcept = 0;
};

}  // namespace cellcal::drivers
