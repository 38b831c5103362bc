#pragma once
// EKI's telegrams: the adapter writes <RobotCommand> and reads <RobotState>. krl/README.md
// documents the protocol, krl/CellcalEki.xml the elements. Degrees, seconds and percent, as
// transmitted.
//
// Hostile or damaged input yields an error value; nothing throws or allocates after a parser has
// been constructed.

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "drivers/kuka/wire/xml_arena.h"
#include "drivers/robot.h"

namespace cellcal::drivers {

// Splits a TCP stream of EKI into XML documents: from the '<' of a root element to its closing tag.
// TCP has no message boundaries; documents arrive in fragments and several at once.
//
// Assumption: KUKA's documents contain neither comments nor CDATA, so the first closing tag with
// the root's name is the root's. If that fails the piece is not well-formed, which the parser
// reports. Hostile input yields a value; nothing allocates or throws.

/// Largest document accepted. Actual ones have 0.3 to 1 kB.
inline constexpr std::size_t kMaxEkiDocument = 8192;

class EkiFramer {
 public:
  enum class Event {
    kNone,
    kDocument,   ///< document() is complete
    kOversized,  ///< no end within kMaxEkiDocument bytes: synchronisation is lost
  };

  Event push(char c);
  /// After kDocument, until the next push().
  std::string_view document() const { return {bytes_.data(), size_}; }
  /// A new connection.
  void reset();

 private:
  enum class State { kOutside, kOpened, kProlog, kName, kRootTag, kBody, kBodyTag, kClosing };

  Event keep(char c);
  Event on_root_tag(char c);
  Event on_closing(char c);
  std::string_view name() const { return {bytes_.data() + 1, name_size_}; }

  std::array<char, kMaxEkiDocument> bytes_{};
  std::size_t size_ = 0, name_size_ = 0, matched_ = 0, skipped_ = 0;
  State state_ = State::kOutside;
  char quote_ = '\0', last_ = '\0';
};

/// RobotCommand/@Type.
enum class EkiType : int {
  kHello = 1,  ///< this connection's session; commands of any other session are void
  kBeat = 2,   ///< this computer is alive
  kMove = 3,
  kStop = 4,  ///< the move with this Id and all preceding ones, started or not
  kBye = 5,   ///< stop, and obey no session until the next hello
  kRun = 6,   ///< start CELLCAL_EKI, if the controller permits it
};

/// RobotCommand/Move/@Guard: stop condition of the move on the controller itself.
enum class EkiGuard : int { kNone = 0, kInput = 1 };

/// RobotCommand/Move/@Path.
enum class EkiPath : int {
  kPtp = 1,  ///< synchronous PTP at Percent of the axis speeds
  kLin = 2,  ///< straight to the target position in Duration seconds
};

/// RobotState/Move/@State.
enum class EkiProgress : int { kIdle = 0, kMoving = 1, kDone = 2 };

/// RobotState/Move/@Outcome, when done.
enum class EkiOutcome : int {
  kNone = 0,
  kArrived = 1,
  kInput = 2,         ///< stopped by the contact input; Latch holds $AXIS_INT
  kStop = 3,          ///< stopped by EkiType::kStop, or a new session
  kInputAtStart = 4,  ///< not started: the input was on
  kSoftLimit = 5,     ///< not started: outside the software limit switches
  kNotFeasible = 6,   ///< not started: target or speed could not be computed
  kDeadMan = 7,       ///< stopped: no telegram for too long, or one is missing
  kAborted = 8,       ///< drives off, stop, emergency stop or program cancelled
};

enum class EkiError : std::uint8_t {
  kNone,
  kOversized,
  kNotXml,
  kWrongRoot,
  kMissing,    ///< a required element
  kNoAxes,     ///< no Axis with A1
  kBadNumber,  ///< not a number, not finite, or not an integer if required
  kDuplicate,  ///< an element occurs twice: ambiguous
};
const char* to_string(EkiError error);

struct EkiCommand {
  std::uint32_t session = 0;  ///< 1..2^31-1
  std::uint32_t seq = 0;      ///< counts the telegrams of this connection, from 1
  EkiType type = EkiType::kBeat;
  std::uint32_t id = 0;   ///< move, or newest move to stop
  AxisAngles target_deg;  ///< six axes, then external ones
  EkiGuard guard = EkiGuard::kNone;
  EkiPath path = EkiPath::kPtp;
  int percent = 1;
  double duration_s = 0.0;
};

/// X, Y, Z [mm], A, B, C [deg].
using EkiFrameValues = std::array<double, 6>;

struct EkiState {
  std::uint32_t session = 0;  ///< obeyed by the controller; 0: none
  std::uint32_t heard = 0;    ///< newest Seq of that session
  std::optional<std::uint32_t> time_ms;
  AxisAngles axes_deg;  ///< $AXIS_ACT_MEAS
  int decimals = 0;     ///< maximum over the angles
  /// $POS_ACT in the active base; empty: not sent by older programs, or without a tool and a base.
  std::optional<EkiFrameValues> tcp;
  bool sends_tcp = false;  ///< Pos is an element of the channel
  std::uint32_t move_id = 0;
  EkiProgress progress = EkiProgress::kIdle;
  EkiOutcome outcome = EkiOutcome::kNone;
  std::optional<std::uint32_t> latch_id;         ///< move that the latch belongs to
  AxisAngles latch_deg;                          ///< $AXIS_INT
  bool ready = false;                            ///< program running, drives on, no stop
  OperatingMode mode = OperatingMode::kUnknown;  ///< Status/@Mode, its number
  bool drives = true, stopped = false, input = false;
  int override_percent = 100;
  int fault = 0;          ///< of the controller's own program; listed in krl/README.md
  std::uint32_t bad = 0;  ///< telegrams unreadable for the controller
  std::uint32_t pass_ms =
      0;  ///< the submit program's longest pass since the last state; 0: unknown
  ControllerRequest request =
      ControllerRequest::kNone;  ///< Status/@Request, its number; also if not sent
};

/// Parses documents in its own memory. One per thread.
class EkiParser {
 public:
  /// Names in any case and order, values as attributes or as elements, unknown ones ignored.
  EkiError parse_state(std::string_view document, EkiState& state);

 private:
  XmlArena arena_{kMaxEkiDocument};
};

/// Size sufficient for any telegram.
inline constexpr std::size_t kEkiTelegram = 1024;

/// Formats a telegram into `buffer`. Every telegram contains all elements: the controller keeps a
/// queue per element, and a missing one would shift its queue relative to the others. Empty: does
/// not fit.
std::string_view format_command(const EkiCommand& command, std::span<char> buffer);

// EKI's telegrams for TOOL_DATA[n] and BASE_DATA[n]: <RobotCommand><Frame .../></RobotCommand> is the
// request, and every <RobotState> repeats the newest answer. krl/README.md documents the protocol.
// Millimetres and degrees, as on the controller. The advice of the checks uses the same telegrams.
//
// Hostile or damaged input yields an error value. Not for the cycle: it allocates.

/// RobotCommand/Frame/@Kind.
enum class EkiFrameKind : int {
  kTool = 1,
  kBase = 2,
  kAdvice = 3,  ///< number 1: CELLCAL_ADVICE_UNTIL and CELLCAL_ADVICE, as X and Y
};

/// 1..2^31-1, hard to guess: number of a session, or of a telegram with a frame.
std::uint32_t draw_number();

/// RobotState/Frame/@Done.
enum class EkiFrameDone : int {
  kNotYet = 0,
  kDone = 1,
  kInSession = 2,     ///< refused: a session is obeyed, or a move is active
  kMoves = 3,         ///< refused: the arm is not at rest
  kNoSuchNumber = 4,  ///< refused: $config.dat has no frame of this number
  kOtherProgram = 5,  ///< refused: another robot program runs
  kIncomplete = 6,    ///< refused: elements of the telegram were missing
};

struct EkiFrameCommand {
  std::uint32_t ask = 0;  ///< 1..2^31-1, unique per telegram
  bool set = false;       ///< false: read only
  EkiFrameKind kind = EkiFrameKind::kTool;
  int number = 0;
  EkiFrameValues values{};  ///< for `set`
};

struct EkiFrameAnswer {
  std::uint32_t ask = 0;  ///< of the newest telegram; 0: none on this connection
  bool set = false;       ///< for kIncomplete this and the members other than `done` are undefined
  EkiFrameKind kind = EkiFrameKind::kTool;
  int number = 0;
  EkiFrameDone done = EkiFrameDone::kNotYet;
  EkiFrameValues old_values{};  ///< before setting
  EkiFrameValues new_values{};  ///< read back after setting
};

/// Decimals of the transmitted text.
inline constexpr int kFrameMmDecimals = 4, kFrameDegDecimals = 5;

/// Empty if it does not fit into a telegram: a value that is not finite or too large.
std::optional<std::string> format_frame_command(const EkiFrameCommand& command);

/// From a state that EkiParser accepts. `answer` is empty if the controller's program does not support
/// frames, or if there was no request (ask is 0, the other values are undefined). A state with a part of the
/// elements, a duplicate, or an invalid number is an error.
EkiError parse_frame_answer(std::string_view document, std::optional<EkiFrameAnswer>& answer);
/// True if the state has the elements of an answer.
bool knows_frames(std::string_view document);

}  // namespace cellcal::drivers
