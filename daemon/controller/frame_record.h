#pragma once
// A frame that was sent to the controller: what was there before, what was sent, what came of it.

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/kuka/eki/eki_frames.h"

namespace cellcal::daemon {

enum class FrameOutcome {
  kSet,
  kDiffers,  ///< set, and read back otherwise
  kRefused,  ///< by the controller: as it was before
  kNotSent,  ///< likewise
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
  int id = 0;  ///< from 1, never used again
  std::string time, by, reason;
  FrameName name;
  drivers::EkiFrameValues before{}, sent{};  ///< mm, deg
  std::optional<drivers::EkiFrameValues> read_back;
  FrameOutcome outcome = FrameOutcome::kUnknown;
  std::string words;            ///< what came of it, and what to do
  std::optional<int> restores;  ///< id of the record whose old values these are
};

/// "{X 60.1234,Y ...}" as $config.dat has it.
std::string krl_text(const drivers::EkiFrameValues& values);

std::string frames_to_json(const std::vector<FrameRecord>& records);
/// Throws std::runtime_error naming `file`, the record and what is wrong with it.
std::vector<FrameRecord> frames_from_json(const std::string& text, const std::string& file);

}  // namespace cellcal::daemon
