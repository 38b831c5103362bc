// Verification of corrections in space: POSCORR and its monitor in the context, $TOOL and $BASE in
// the program.

#include "drivers/kuka/krl/krl_rsi.h"
#include "drivers/kuka/wire/xml_values.h"

namespace cellcal::drivers::krl {
namespace {

// Defaults of the objects for parameters absent from the context.
constexpr double kDefaultLimitMm = 5, kDefaultTurnDeg = 5, kDefaultMonitor = 6;
constexpr double kSpaceRounding = 1e-9;
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

struct Bound {
  const char *parameter, *key, *unit;
  double limit, usual, sign;
  const char* then;
};

void check_bound(const RsiSet& set, const RsiContextFile& file, const RsiObject& object,
                 const Bound& bound) {
  const ParameterValue have =
      value_of(set, file, object, bound.parameter, bound.sign * bound.usual);
  if (bound.sign * have.value >= bound.limit - kSpaceRounding) return;
  set.findings.refuse(file.name, have.line,
                      "{} of {} is {} {}, [rsi] {} is {}: {}. Raise the one or lower the other",
                      bound.parameter, object.id, have.value, bound.unit, bound.key, bound.limit,
                      bound.then);
}

constexpr const char* kShiftKey = "correction_limit_mm";
constexpr const char* kTurnKey = "correction_turn_limit_deg";

}  // namespace

void check_space(const RsiSet& set, const RsiContextFile& file, const RsiObject& corrector) {
  const SpaceCorrection& space = set.config.space;
  const char* const clamped = "moves would be silently clamped";
  for (const char* name : {"LowerLimX", "LowerLimY", "LowerLimZ"})
    check_bound(set, file, corrector,
                {name, kShiftKey, "mm", space.limit_mm, kDefaultLimitMm, -1, clamped});
  for (const char* name : {"UpperLimX", "UpperLimY", "UpperLimZ"})
    check_bound(set, file, corrector,
                {name, kShiftKey, "mm", space.limit_mm, kDefaultLimitMm, 1, clamped});
  check_bound(set, file, corrector,
              {"MaxRotAngle", kTurnKey, "deg", space.turn_limit_deg, kDefaultTurnDeg, 1, clamped});
  check_frame(set, file, corrector);
  const RsiObject* monitor = file.only("POSCORRMON");
  if (monitor == nullptr) {
    if (space.limit_mm > kDefaultMonitor || space.turn_limit_deg > kDefaultMonitor) {
      set.findings.refuse(file.name, 0,
                          "POSCORRMON is missing: it then stops at {0} mm or {0} deg, [rsi] "
                          "correction_limit_mm is {1}, correction_turn_limit_deg {2}",
                          kDefaultMonitor, space.limit_mm, space.turn_limit_deg);
    }
    return;
  }
  const char* const stopped = "RSI would stop with KSS29000";
  check_bound(set, file, *monitor,
              {"MaxTrans", kShiftKey, "mm", space.limit_mm, kDefaultMonitor, 1, stopped});
  check_bound(set, file, *monitor,
              {"MaxRotAngle", kTurnKey, "deg", space.turn_limit_deg, kDefaultMonitor, 1, stopped});
}

void check_frames(const std::string& name, const std::string& text, const RsiFilesConfig& config,
                  Findings& findings) {
  const auto value = [](const char* array, int number) {
    return number == 0 ? std::string("$NULLFRAME") : fmt::format("{}[{}]", array, number);
  };
  for (const auto& [line, number] : statements(text)) {
    for (const auto& [variable, key, wanted] :
         {std::tuple{"$TOOL=", "tool", value("TOOL_DATA", config.tool)},
          std::tuple{"$BASE=", "base", value("BASE_DATA", config.base)}}) {
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
