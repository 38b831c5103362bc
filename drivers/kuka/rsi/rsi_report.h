#pragma once
// What the cycle reports, as plain values without words, and the words that people read. The words
// are made on the reader's side: making them allocates.

#include <cstdint>
#include <string>

#include "drivers/kuka/wire/rsi_codec.h"
#include "drivers/robot.h"

namespace cellcal::drivers {

/// Why the adapter does not answer, or not yet as it should.
enum class Trouble : std::uint8_t {
  kNone,
  kLearning,  ///< cycle not yet known
  kOddCycle,  ///< outside 2..40 ms
  kCoarse,    ///< fewer than 3 decimals in AIPos
  kTooFewAxes,
  kWaitingForRest,    ///< correction not known while the arm moves
  kUnknownOffset,     ///< correction that the controller holds cannot be known: no reply
  kCorrectionDenied,  ///< AIPos - ASPos is not what was sent, and no new session shows: no reply
  kUnknownSum,        ///< likewise, relative: replies hold the arm, and no reference is taken
  kNoDelay,           ///< relative without Delay: lost increments would not be noticed
  kNotAccepted,       ///< Delay grows with every reply
  kTcpDiffers,        ///< in space: RIst is not where the geometry has the TCP
};

/// In space: RIst against the geometry at the same axes; 0: not compared.
struct TcpApart {
  double mm = 0.0, deg = 0.0;
  /// More than rounding and noise: another tool, base or arm. A tool that is wrong by so little
  /// takes the arm astray by as little times the turn.
  bool much() const { return !(mm <= 0.5 && deg <= 0.05); }
};

/// Plain values, so that a snapshot can be copied word by word.
struct CoreState {
  RobotLink link = RobotLink::kDown;
  Trouble trouble = Trouble::kNone;
  bool moving = false;
  bool rereference_pending = false;
  bool refused_when_lost = false;  ///< the session that was lost had taken none of the replies
  std::uint8_t axes = 0;
  WireError last_error = WireError::kNone;
  double actual_rad[kMaxAxes] = {};
  double commanded_rad[kMaxAxes] = {};
  double cycle_s = 0.0;
  double waited_s = 0.0;  ///< since the last packet, or since the link was opened
  double silent_s = 0.0;  ///< when the link was lost: since the last packet, or the last new one
  std::uint64_t packets = 0, replies = 0, late = 0, gaps = 0, bad_packets = 0;
  std::uint32_t late_while_moving = 0;
  std::int32_t decimals = -1;
  bool decimals_unproven = false;  ///< so few may be exact: the angles have not changed yet
  bool relative = false;           ///< corrections are increments
  std::uint32_t ipoc_step = 0;     ///< per packet, 0 if not known
  bool sends_setpoint = false, sends_delay = false;  ///< ASPos and Delay were in the newest packet
  OperatingMode mode = OperatingMode::kUnknown;      ///< of the newest packet
  std::int32_t override_percent = -1;                ///< likewise; below 0: it did not tell
  InputPath input_path = InputPath::kNone;           ///< the second stop path
  bool input_contact = false;                        ///< what it says
  std::uint32_t stops_by_input = 0;                  ///< by it, before the sensor's bytes
  double jitter_s = 0.0, longest_gap_s = 0.0;        ///< of this session's arrivals
  std::uint32_t ipoc = 0;
  Interruption interruption = Interruption::kNone;  ///< since the last reference
  std::uint32_t interruptions = 0;
  std::uint32_t session = 0;  ///< counts up with each that is not proven to be the one before
  TcpApart tcp_apart;
  char last_bad[48] = {};  ///< how the last bad datagram began, printable characters only
};

/// Limits and addresses that the words name.
struct ReportNames {
  std::string listening;  ///< "address:port"
  std::string sentype;
};

RobotState to_robot_state(const CoreState& state, const ReportNames& names);

}  // namespace cellcal::drivers
