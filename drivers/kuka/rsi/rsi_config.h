#pragma once
// What a cell sets about its RSI link. The names in quotes are those of the controller's files.

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/robot.h"

namespace cellcal::drivers {

/// 0.2 s at 4 ms: nobody stops and starts RSI within it, so such a silence hides no new session.
inline constexpr int kMostSilenceCycles = 50;
inline constexpr std::size_t kLongestTag = 32;
/// May stand as an XML element, or as SENTYPE, without any escaping: 1 to kLongestTag letters,
/// digits, '_', '-', '.', a letter or '_' first.
bool is_tag(std::string_view name);

/// RSI_ON(#ABSOLUTE | #RELATIVE) in the KRL program, and what belongs to it.
enum class CorrectionMode {
  kAbsolute,  ///< with HOLDON=1: a late reply makes the arm hold
  kRelative,  ///< with HOLDON=0: increments; a late reply is a step that is lost. Needs DEF_Delay
};

class ArmGeometry;

/// POSCORR's RefCorrSys, as far as it can be driven: what X Y Z A B C of a correction refer to.
enum class CorrectionFrame {
  kBase,     ///< $BASE, which has to be $NULLFRAME, with the robot's root parallel to the world
  kRobRoot,  ///< the robot's root, whatever $BASE is
  kTool,     ///< the TCP at RSI_ON
};

/// Corrections in space (POSCORR) instead of those of axes; rsi_space.h has the model.
struct SpaceCorrection {
  bool on = false;
  std::string tag = "RKorr";  ///< RECEIVE tag of X Y Z A B C
  CorrectionFrame frame = CorrectionFrame::kBase;
  double limit_mm = 500.0;       ///< of the whole shift: at most POSCORR's and POSCORRMON's
  double turn_limit_deg = 90.0;  ///< of the whole turn: at most MaxRotAngle of both
  /// RIst, where it is sent, has to agree with the geometry; false where $BASE is not $NULLFRAME.
  bool compare_tcp = true;
  std::shared_ptr<const ArmGeometry> geometry;  ///< of the nominal arm with the controller's tool
};

struct RsiConfig {
  std::string bind_address = "0.0.0.0";  ///< the PC's address in the controller's subnet
  std::uint16_t port = 49152;            ///< CONFIG/PORT; 0 takes a free one (tests)
  std::string sentype = "ImFree";        ///< CONFIG/SENTYPE; a mismatch is discarded in silence
  std::string axis_tag = "AK";           ///< RECEIVE tag of the axis corrections
  std::string external_axis_tag = "EK";  ///< likewise, for the seventh axis and on
  std::string stop_tag = "Stop";         ///< RECEIVE tag wired to the STOP object; empty: none
  /// SEND tags, "Element.Attribute" or "Element"; empty: not read. Where they are not sent, mode and
  /// override are unknown.
  std::string mode_tag = "Mode.R", override_tag = "OvPro.R";
  /// Likewise of the digital input that the sensor's opto output is wired to: off is contact. Empty:
  /// there is no such stop path.
  std::string contact_tag;
  int decimals = 6;            ///< of the corrections sent, 4..9
  int silence_cycles = 3;      ///< cycles without a packet that mean 'lost'
  int late_replies_limit = 3;  ///< counted by the controller within one move: stop
  CorrectionMode mode = CorrectionMode::kAbsolute;
  bool hold_on = true;            ///< HOLDON of every correction element
  std::vector<AxisLimit> limits;  ///< one per axis
  /// One per axis: the controller's own limits, beyond which it stops. None: the speeds of `limits`.
  std::vector<double> full_speed_rad_s;
  std::vector<double> correction_limit_deg;  ///< one per axis: at most AXISCORR's and the monitor's
  SpaceCorrection space;
  /// An arm farther than this from everything commanded within follow_window_s does not follow.
  double follow_tolerance_deg = 0.05;
  double follow_window_s = 0.2;
  /// Longest lag from setpoint to AIPos that is still normal: 10 to 40 ms on a KRC4, 120 on a KRC2.
  /// Stands for how early after the start of a move an arm that does not move can be told from one
  /// that has not yet begun to.
  double longest_lag_s = 0.12;

  /// Throws ConfigError naming the key, the value and what to do.
  void validate() const;
};

/// The axis limits, with speeds so far below the controller's own that what the wire's last decimal
/// adds from reply to reply does not pass those.
std::vector<AxisLimit> limits_within_wire(const RsiConfig& config);

}  // namespace cellcal::drivers
