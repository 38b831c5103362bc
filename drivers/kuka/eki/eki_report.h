#pragma once
// Plain values reported by the EKI core, and their sentences.

#include <cstdint>
#include <optional>
#include <string>

#include "drivers/kuka/moves/cause.h"
#include "drivers/kuka/wire/eki_codec.h"
#include "drivers/robot.h"

namespace cellcal::drivers {

/// Current fault of the link.
enum class EkiTrouble : std::uint8_t {
  kNone,
  kNotConnected,  ///< no TCP connection
  kNoState,       ///< connected, but no state received
  kNotHeard,      ///< states arrive, but the hello is not obeyed
  kOtherSession,  ///< the controller obeys another session
  kTooFewAxes,
  kCoarse,    ///< fewer than 3 decimals in all angles
  kNotReady,  ///< program, drives, stop or operating mode: see the status
  kUnread,    ///< telegrams are not confirmed
};

/// Cause of the last loss of the link.
enum class EkiLoss : std::uint8_t {
  kNone,
  kSilence,
  kClosed,        ///< by the controller, or cable disconnected
  kSessionTaken,  ///< the controller obeys another session
  kNotAStream,    ///< not EKI documents
  kNotTaken,      ///< a move or stop was not confirmed
};

/// Trivially copyable, so that a snapshot can be copied word by word.
struct EkiCoreState {
  RobotLink link = RobotLink::kDown;
  EkiTrouble trouble = EkiTrouble::kNotConnected;
  EkiLoss loss = EkiLoss::kNone;
  bool moving = false;
  bool rereference_pending = false;
  bool connected = false;
  bool ready = false, drives = false, stopped = false, input = false;
  std::uint8_t axes = 0, wire_axes = 0;
  bool linear_unit = false;
  std::optional<cause::MovedUnasked> unasked;  ///< since the last reference
  OperatingMode mode = OperatingMode::kUnknown;
  ControllerRequest request = ControllerRequest::kNone;
  EkiError last_error = EkiError::kNone;
  std::int32_t override_percent = 100, fault = 0;
  std::int32_t decimals_seen = 0;              ///< maximum over the angles on this connection
  double jitter_s = 0.0, longest_gap_s = 0.0;  ///< of this connection's states
  double actual_rad[kMaxAxes] = {};
  double commanded_rad[kMaxAxes] = {};
  bool sends_tcp = false;   ///< $POS_ACT is an element of the channel
  bool states_tcp = false;  ///< and is known to the controller
  EkiFrameValues tcp{};     ///< [mm, deg], of the state of actual_rad
  double cycle_s = 0.0;
  double waited_s = 0.0;  ///< since the last state, or since opening the link
  std::uint32_t session = 0, other_session = 0;
  std::uint32_t unread_by_controller = 0;
  std::uint32_t longest_pass_ms = 0;  ///< of the submit program on this connection; 0: unknown
  std::uint64_t states = 0, bad_documents = 0;
  char last_bad[48] = {};  ///< beginning of the last bad document, printable characters only
};

RobotState to_robot_state(const EkiCoreState& state, const std::string& peer);

}  // namespace cellcal::drivers
