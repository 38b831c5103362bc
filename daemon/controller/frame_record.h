#pragma once
// Record of a frame sent to the controller: old value, sent value and result.

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/kuka/eki/eki_frames.h"
#include "drivers/kuka/eki/eki_position.h"

namespace cellcal::daemon {

enum class FrameOutcome {
  kSet,
  kDiffers,  ///< set, but read back differently
  kRefused,  ///< by the controller: unchanged
  kNotSent,  ///< unchanged
  kUnknown,
};
const char* to_string(FrameOutcome outcome);

struct FrameName {
  drivers::EkiFrameKind kind = drivers::EkiFrameKind::kTool;
  int number = 0;  ///< 1..128
  bool operator==(const FrameName&) const = default;
};
/// "TOOL_DATA[3]"
std::string to_string(const FrameName& name);
std::optional<FrameName> frame_name(std::string_view text);

struct FrameRecord {
  int id = 0;  ///< from 1, never reused
  std::string time, by, reason;
  FrameName name;
  drivers::EkiFrameValues before{}, sent{};  ///< mm, deg
  std::optional<drivers::EkiFrameValues> read_back;
  FrameOutcome outcome = FrameOutcome::kUnknown;
  std::string words;            ///< result and remedy
  std::optional<int> restores;  ///< id of the record whose old values were restored
};

/// "{X 60.1234,Y ...}" as in $config.dat.
std::string krl_text(const drivers::EkiFrameValues& values);

std::string frames_to_json(const std::vector<FrameRecord>& records);
/// Throws std::runtime_error naming `file`, the record and the fault.
std::vector<FrameRecord> frames_from_json(const std::string& text, const std::string& file);

// Text of the results of frame transfers; the single source of this wording.

std::string not_configured_words();
/// Reason why a frame was not read or set, or why its state is unknown; with the remedy.
std::string why_words(const drivers::EkiFrameResult& result);
/// Nothing was sent, or the controller refused.
std::string not_sent_words(const FrameName& name, const drivers::EkiFrameResult& result);
std::string unknown_words(const FrameRecord& record, const std::string& why);
/// Reason why the arm's position was not read, with the remedy; and the text where it is not supported.
std::string position_words(const drivers::EkiPosition& position);
std::string no_position_words();
std::string outcome_words(const FrameRecord& record, const drivers::EkiFrameResult& result);

}  // namespace cellcal::daemon
