#pragma once
// Configuration of a cell's RSI link. Names in quotes are those of the controller's files.

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/kuka/wire/rsi_codec.h"
#include "drivers/robot.h"

namespace cellcal::drivers {

/// 0.2 s at 4 ms: RSI cannot be stopped and started within it, so that such a silence hides no new
/// session.
inline constexpr int kMostSilenceCycles = 50;
inline constexpr std::size_t kLongestTag = 32;
/// True if valid as an XML element, or as SENTYPE, without escaping: 1 to kLongestTag letters,
/// digits, '_', '-', '.', a letter or '_' first.
bool is_tag(std::string_view name);

/// RSI_ON(#ABSOLUTE | #RELATIVE) in the KRL program, and the matching settings.
enum class CorrectionMode {
  kAbsolute,  ///< with HOLDON=1: the arm holds on a late reply
  kRelative,  ///< with HOLDON=0: increments; a late reply loses a step. Needs DEF_Delay
};

class ArmGeometry;

/// Supported values of POSCORR's RefCorrSys: the frame that X Y Z A B C of a correction refer to.
enum class CorrectionFrame {
  kBase,     ///< $BASE = $NULLFRAME, with the robot's root parallel to the world
  kRobRoot,  ///< the robot's root, for any $BASE
  kTool,     ///< the TCP at RSI_ON
};

/// Corrections in space (POSCORR) instead of axis corrections; rsi_space.h documents the model.
struct SpaceCorrection {
  bool on = false;
  std::string tag = "RKorr";  ///< RECEIVE tag of X Y Z A B C
  CorrectionFrame frame = CorrectionFrame::kBase;
  double limit_mm = 500.0;       ///< of the total shift: at most POSCORR's and POSCORRMON's
  double turn_limit_deg = 90.0;  ///< of the total rotation: at most MaxRotAngle of both
  /// Requires RIst, if sent, to agree with the geometry; false if $BASE is not $NULLFRAME.
  bool compare_tcp = true;
  std::shared_ptr<const ArmGeometry> geometry;  ///< of the nominal arm with the controller's tool
};

struct RsiConfig : RsiNames {
  std::string bind_address = "0.0.0.0";  ///< the PC's address in the controller's subnet
  std::uint16_t port = 49152;            ///< CONFIG/PORT; 0 selects a free one (tests)
  int decimals = 6;                      ///< of the corrections sent, 4..9
  int silence_cycles = 3;                ///< cycles without a packet until the link is lost
  int late_replies_limit = 3;            ///< within one move, as counted by the controller: stop
  CorrectionMode mode = CorrectionMode::kAbsolute;
  bool hold_on = true;            ///< HOLDON of every correction element
  std::vector<AxisLimit> limits;  ///< one per axis
  /// One per axis: the controller's own limits, beyond which it stops. Empty: the speeds of
  /// `limits`.
  std::vector<double> full_speed_rad_s;
  /// One per axis, of a linear unit [mm]: at most AXISCORR's and the monitor's.
  std::vector<double> correction_limit_deg;
  SpaceCorrection space;
  /// Tolerance to everything commanded within follow_window_s; beyond it the arm does not follow.
  double follow_tolerance_deg = 0.05;
  double follow_window_s = 0.2;
  /// Longest normal lag from setpoint to AIPos: 10 to 40 ms on a KRC4, 120 on a KRC2. Determines
  /// how early after the start of a move a standstill can be distinguished from the lag.
  double longest_lag_s = 0.12;

  /// Throws ConfigError naming key, value and remedy.
  void validate() const;
};

/// The axis limits, with speeds reduced below the controller's own by the rounding of the last
/// transmitted decimal between replies.
std::vector<AxisLimit> limits_within_wire(const RsiConfig& config);

}  // namespace cellcal::drivers
