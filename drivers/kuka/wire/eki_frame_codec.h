#pragma once
// EKI's telegrams for TOOL_DATA[n] and BASE_DATA[n]: <RobotCommand><Frame .../></RobotCommand> is the
// request, and every <RobotState> repeats the newest answer. krl/README.md documents the protocol.
// Millimetres and degrees, as on the controller. The advice of the checks uses the same telegrams.
//
// Hostile or damaged input yields an error value. Not for the cycle: it allocates.

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "drivers/kuka/wire/eki_codec.h"

namespace cellcal::drivers {

/// RobotCommand/Frame/@Kind.
enum class EkiFrameKind : int {
  kTool = 1,
  kBase = 2,
  kAdvice = 3,  ///< number 1: CELLCAL_ADVICE_UNTIL and CELLCAL_ADVICE, as X and Y
};

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

/// X, Y, Z [mm], A, B, C [deg].
using EkiFrameValues = std::array<double, 6>;

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
