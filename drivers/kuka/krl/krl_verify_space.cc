// Verification of corrections in space: POSCORR and its monitor in the context, $TOOL and $BASE in
// the program.

#include "drivers/kuka/krl/krl_rsi.h"
#include "drivers/kuka/krl/krl_template.h"
#include "drivers/kuka/wire/xml_values.h"

namespace cellcal::drivers::krl {
namespace {

// TrafoCosysType of RSI: as a number, or by name in RSI-Visual's model.
constexpr std::string_view kFrames[] = {"World", "Base", "RobRoot", "Tool", "TTS"};

/// Number of the frame; -1: unknown.
int frame_number(const std::string& text) {
  double value = 0.0;
  if (wire::parse_number(text, value)) {
    for (int i = 0; i < static_cast<int>(std::size(kFrames)); ++i)
      if (value == i) return i;
    return -1;
  }
  for (int i = 0; i < static_cast<int>(std::size(kFrames)); ++i)
    if (wire::same_name(text, kFrames[static_cast<std::size_t>(i)])) return i;
  return -1;
}

struct Wanted {
  const char* key;
  int number;
};
Wanted wanted_frame(CorrectionFrame frame) {
  if (frame == CorrectionFrame::kTool) return {"tool", 3};
  return frame == CorrectionFrame::kRobRoot ? Wanted{"robroot", 2} : Wanted{"base", 1};
}

void check_frame(const RsiSet& set, const RsiContextFile& file, const RsiObject& corrector) {
  const Wanted wanted = wanted_frame(set.config.space.frame);
  const RsiParameter* found = corrector.parameter("RefCorrSys");
  if (found == nullptr) {
    set.findings.refuse(file.name, corrector.line,
                        "RefCorrSys of {} is missing. Set {} ({}) for [rsi] correction_frame = "
                        "\"{}\"",
                        corrector.id, wanted.number,
                        kFrames[static_cast<std::size_t>(wanted.number)], wanted.key);
    return;
  }
  const int have = frame_number(found->value);
  // With $BASE = $NULLFRAME, Base equals World.
  const bool world = set.config.space.frame == CorrectionFrame::kBase && have == 0;
  if (have == wanted.number || world) return;
  set.findings.refuse(file.name, found->line,
                      "RefCorrSys of {} is {}{}, [rsi] correction_frame is \"{}\", which is "
                      "{}: the arm would move in another direction",
                      corrector.id, found->value,
                      have < 0 ? "" : fmt::format(" ({})", kFrames[static_cast<std::size_t>(have)]),
                      wanted.key, wanted.number);
}

constexpr const char* kShiftKey = "correction_limit_mm";
constexpr const char* kTurnKey = "correction_turn_limit_deg";

}  // namespace

void check_space(const RsiSet& set, const RsiContextFile& file, const RsiObject& corrector) {
  const SpaceCorrection& space = set.config.space;
  for (const double sign : {-1.0, 1.0})
    for (const char axis : {'X', 'Y', 'Z'})
      check_bound(set, file, corrector,
                  {fmt::format("{}Lim{}", sign < 0.0 ? "Lower" : "Upper", axis), kShiftKey, "mm",
                   space.limit_mm, kRsiClamp, sign, kClamped});
  check_bound(set, file, corrector,
              {"MaxRotAngle", kTurnKey, "deg", space.turn_limit_deg, kRsiClamp, 1, kClamped});
  check_frame(set, file, corrector);
  const RsiObject* monitor = file.only("POSCORRMON");
  if (monitor == nullptr) {
    if (space.limit_mm > kRsiMonitor || space.turn_limit_deg > kRsiMonitor) {
      set.findings.refuse(file.name, 0,
                          "POSCORRMON is missing: it then stops at {0} mm or {0} deg, [rsi] "
                          "correction_limit_mm is {1}, correction_turn_limit_deg {2}",
                          kRsiMonitor, space.limit_mm, space.turn_limit_deg);
    }
    return;
  }
  check_bound(set, file, *monitor,
              {"MaxTrans", kShiftKey, "mm", space.limit_mm, kRsiMonitor, 1, kStopped});
  check_bound(set, file, *monitor,
              {"MaxRotAngle", kTurnKey, "deg", space.turn_limit_deg, kRsiMonitor, 1, kStopped});
}

void check_frames(const std::string& name, const std::string& text, const RsiFilesConfig& config,
                  Findings& findings) {
  for (const auto& [line, number] : statements(text)) {
    for (const auto& [variable, key, wanted] :
         {std::tuple{"$TOOL=", "tool", frame_value("TOOL_DATA", config.tool)},
          std::tuple{"$BASE=", "base", frame_value("BASE_DATA", config.base)}}) {
      if (!line.starts_with(variable) || line == variable + wanted) continue;
      findings.refuse(name, number,
                      "{} does not match [controller] {} = {}, with which corrections in space "
                      "are computed. Set {}{}",
                      line, key, key == std::string("tool") ? config.tool : config.base, variable,
                      wanted);
    }
  }
}

}  // namespace cellcal::drivers::krl
