#pragma once
// Corrections in space (POSCORR, tag RKorr): the last step between the axis angles that are
// commanded and the wire, and what can be said against a move for its sake.
//
// Model: the controller takes its nominal TCP at RSI_ON (start axes), shifts it by X, Y, Z and
// turns it by Rz(A) Ry(B) Rx(C), all in the frame of RefCorrSys, and solves for the axes. Base and
// RobRoot: shift along the root's axes, turn about the TCP, about axes parallel to the root's.
// Tool: the frame of the TCP at RSI_ON. Fails safe where that does not hold: the arm then leaves
// what is commanded, and the follow watch stops it.
//
// No turn of less than 90 deg comes near to where A or C go from 180 to -180 deg, or B to 90 deg,
// beside which A and C race. Beyond 90 deg they may; to a controller that composes them it is one
// turn.
//
// Near a singularity a small step in space is a large one of axes, so a move may only pass where
// the arm's inverse stays small (kMostGain).

#include <array>
#include <optional>

#include "drivers/kuka/moves/move_check.h"
#include "drivers/kuka/rsi/rsi_config.h"
#include "drivers/kuka/rsi/rsi_report.h"
#include "drivers/kuka/wire/rsi_codec.h"

namespace cellcal::drivers {

/// At most so many radians of any axis for a metre or a radian of the TCP. A wrist reaches it 3.8
/// deg beside A5 = 0, where the wire's last decimal (1e-6 deg) is 1.5e-5 deg of an axis.
inline constexpr double kMostGain = 15.0;
/// What object_to() says of singularities, for those who plan moves before there is a session.
bool clear_of_singularities(const ArmGeometry& arm, const AxisAngles& from_rad,
                            const AxisAngles& to_rad);

class SpaceCorrector {
 public:
  /// `config` must outlive this. Without effect unless config.on.
  explicit SpaceCorrector(const SpaceCorrection& config) : config_(config) {}

  /// Corrections count from these axes: where the arm stood at RSI_ON.
  void begin(const AxisAngles& start_rad);
  /// What brings the TCP to where the start axes plus `correction_deg` put it: X Y Z [mm], A B C
  /// [deg]. Empty: no finite numbers.
  std::optional<KukaFrame> rkorr(std::span<const double> correction_deg) const;

  /// Along the line from one axis correction to another [rad]: limits of shift and turn,
  /// singularities. The beginning is where the arm stands and is not objected to.
  std::optional<Cause> object_to(const AxisAngles& from_rad, const AxisAngles& to_rad) const;

  /// RIst against the geometry at the axes that came with it. Zero: nothing to compare.
  TcpApart apart(const RobFrame& frame, const AxisAngles& actual_rad) const;

 private:
  KukaFrame frame_at(const AxisAngles& axis_rad) const;

  const SpaceCorrection& config_;
  AxisAngles start_rad_;
  std::array<double, 12> start_{};  // its TCP: rotation's columns and place, no Eigen in headers
};

}  // namespace cellcal::drivers
