#pragma once
// EKI's telegrams about TOOL_DATA[n] and BASE_DATA[n]: <RobotCommand><Frame .../></RobotCommand> asks, and
// every <RobotState> repeats the newest answer. krl/README.md has the protocol. Millimetres and degrees, as
// the controller has them. What the checks of the calibration say goes the same way.
//
// Hostile or damaged input gives an error value. Not for the cycle: it allocates.

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
  kInSession = 2,     ///< refused: somebody is obeyed, or a move is under way
  kMoves = 3,         ///< refused: the arm does not stand
  kNoSuchNumber = 4,  ///< refused: $config.dat has no frame of this number
  kOtherProgram = 5,  ///< refused: another robot program runs
  kIncomplete = 6,    ///< refused: elements of the telegram were missing
};

/// X, Y, Z [mm], A, B, C [deg].
using EkiFrameValues = std::array<double, 6>;

struct EkiFrameCommand {
  std::uint32_t ask = 0;  ///< 1..2^31-1, another one for each telegram
  bool set = false;       ///< false: only what it is now
  EkiFrameKind kind = EkiFrameKind::kTool;
  int number = 0;
  EkiFrameValues values{};  ///< `set`
};

struct EkiFrameAnswer {
  std::uint32_t ask = 0;  ///< of the newest telegram; 0: none on this connection
  bool set = false;       ///< of kIncomplete this and what follows beside `done` mean nothing
  EkiFrameKind kind = EkiFrameKind::kTool;
  int number = 0;
  EkiFrameDone done = EkiFrameDone::kNotYet;
  EkiFrameValues old_values{};  ///< before it
  EkiFrameValues new_values{};  ///< read again behind it
};

/// Decimals of the text that is sent.
inline constexpr int kFrameMmDecimals = 4, kFrameDegDecimals = 5;

/// None where it does not fit into a telegram: a number that is none, or beyond all measure.
std::optional<std::string> format_frame_command(const EkiFrameCommand& command);

/// Of a state that EkiParser takes. `answer` is none where the controller's program knows no frames, and
/// where nothing was asked (ask is 0: what stands beside it means nothing). A state that holds a part of the
/// elements, or one twice, or a number that is none, is an error.
EkiError parse_frame_answer(std::string_view document, std::optional<EkiFrameAnswer>& answer);
/// The state has the elements of an answer at all.
bool knows_frames(std::string_view document);

}  // namespace cellcal::drivers
