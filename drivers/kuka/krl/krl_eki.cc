// EKI's set of controller files.

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <string_view>
#include <vector>

#include "drivers/error.h"
#include "drivers/kuka/krl/krl_files.h"
#include "drivers/kuka/wire/eki_codec.h"
#include "drivers/kuka/wire/xml_values.h"

namespace cellcal::drivers {
namespace {

constexpr int kAxes = 6;
// Values queued per element before EKI closes the connection: the adapter's window of at most 8 and
// its three stops, with margin.
constexpr int kBufferLimit = 16;
// Interval between checks of the channel.
constexpr int kChannelCheckMs = 3000;
// Interval between proofs that CELLCAL_EKI waits: above the largest delay of the robot interpreter.
constexpr int kEchoMs = 300;
// m/s. LIN is used for searches and for backing off; T1's limit is the reasonable maximum.
constexpr const char* kLinLimit = "0.25";
// m/s^2. At 10 mm/s the ramp is 0.1 mm long.
constexpr const char* kAccCp = "0.5";

void check(const char* key, int value, int low, int high) {
  if (value < low || value > high) {
    throw ConfigError(
        fmt::format("controller files: {} = {} is outside {}..{}", key, value, low, high));
  }
}

/// One line per axis; {0} is "A1", {1} the element "Axis" or "Ext", {2} the number in an array.
std::string per_axis(std::string_view form, int external_axes, std::string_view first,
                     std::string_view external) {
  std::string text;
  for (int i = 0; i < kAxes + external_axes; ++i) {
    const bool own = i < kAxes;
    const std::string name = fmt::format("{}{}", own ? 'A' : 'E', i % kAxes + 1);
    if (!text.empty()) text += '\n';
    text += fmt::format(fmt::runtime(form), name, own ? first : external, i + 1);
  }
  return text;
}

/// External axes have separate arrays, not affected by $VEL_AXIS and $ACC_AXIS.
std::string external_speeds(const EkiFilesConfig& c) {
  if (c.external_axes == 0) return "";
  return fmt::format(R"(  FOR I=1 TO {}
    $VEL_EXTAX[I]=CC_PERCENT
    $ACC_EXTAX[I]={}
  ENDFOR)",
                     c.external_axes, c.acceleration_percent);
}

// Asked for no more than the servo's noise, an external axis does not move at all: deg, mm.
constexpr const char* kExternalHold = R"(  IF ABS(CC_TARGET.{0}-$AXIS_ACT.{0})<0.1 THEN
    CC_TARGET.{0}=$AXIS_ACT.{0}
  ENDIF)";
// For one that no telegram names CC_TARGET has the data list's 0.0; one that does not exist reads as 0.0.
constexpr const char* kExternalStay = "  CC_TARGET.{0}=$AXIS_ACT.{0}";

std::string external_hold(int external_axes) {
  std::string text;
  for (int i = 1; i <= kAxes; ++i) {
    if (!text.empty()) text += '\n';
    text += fmt::format(fmt::runtime(i <= external_axes ? kExternalHold : kExternalStay),
                        fmt::format("E{}", i));
  }
  return text;
}

/// Requests of the controller, in order of precedence.
std::string requests(const EkiFilesConfig& c) {
  std::string text;
  for (const auto& [output, request] :
       {std::pair{c.mastering_test_output, ControllerRequest::kMasteringTest},
        std::pair{c.brake_test_output, ControllerRequest::kBrakeTest},
        std::pair{c.collision_output, ControllerRequest::kCollision}}) {
    if (output == 0) continue;
    text += fmt::format("{}  IF $OUT[{}]==TRUE THEN\n    ASKED={}\n  ENDIF",
                        text.empty() ? "" : "\n", output, static_cast<int>(request));
  }
  return text;
}

std::string number_or(const char* array, int number, const char* otherwise) {
  return number == 0 ? otherwise : fmt::format("{}[{}]", array, number);
}

// Sizes of TOOL_DATA and BASE_DATA in $config.dat, of every release.
constexpr int kTools = 16, kBases = 32;
// Rest for this time, in steps of less than a hundredth of a degree, is not a pause within a
// motion.
constexpr int kFrameRestMs = 300;

/// One line for each component of a frame; {0} is "X".
std::string per_component(std::string_view form) {
  std::string text;
  for (const char name : wire::kFrameNames) {
    if (!text.empty()) text += '\n';
    text += fmt::format(fmt::runtime(form), name);
  }
  return text;
}

std::string without_cr(std::string text) {
  std::erase(text, '\r');
  while (text.ends_with('\n')) text.pop_back();
  return text;
}

std::string frame_numbers() {
  return fmt::format(
      "  OK=OK OR ((CC_FRAME_KIND==1) AND (CC_FRAME_NO>=1) AND (CC_FRAME_NO<={}))\n"
      "  OK=OK OR ((CC_FRAME_KIND==2) AND (CC_FRAME_NO>=1) AND (CC_FRAME_NO<={}))",
      kTools, kBases);
}

/// CASE `kind` of CC_FRAME_SET: an array of $config.dat.
std::string frame_case(int kind, const char* array) {
  return fmt::format(R"(    CASE {0}
      CC_FRAME_OLD={1}[CC_FRAME_NO]
      IF CC_FRAME_DO==2 THEN
        {1}[CC_FRAME_NO]=CC_FRAME_AIM
      ENDIF
      CC_FRAME_NEW={1}[CC_FRAME_NO])",
                     kind, array);
}

constexpr const char* kAdviceCase = R"(    CASE 3
      CC_FRAME_OLD=$NULLFRAME
      CC_FRAME_OLD.X=CELLCAL_ADVICE_UNTIL
      CC_FRAME_OLD.Y=CELLCAL_ADVICE
      IF CC_FRAME_DO==2 THEN
        CELLCAL_ADVICE_UNTIL=CC_FRAME_AIM.X
        CELLCAL_ADVICE=CC_FRAME_AIM.Y
      ENDIF
      CC_FRAME_NEW=$NULLFRAME
      CC_FRAME_NEW.X=CELLCAL_ADVICE_UNTIL
      CC_FRAME_NEW.Y=CELLCAL_ADVICE)";

// During production: requires neither rest nor an idle robot interpreter.
constexpr const char* kAdviceWhy = R"(  IF CC_FRAME_KIND==3 THEN
    IF (CC_FRAME_NO==1) AND (CC_FRAME_AIM.Y>=0.0) AND (CC_FRAME_AIM.Y<=5.0) THEN
      RETURN (0)
    ENDIF
    RETURN (4)
  ENDIF)";

constexpr const char* kAdviceAges = R"(
DEF CC_ADVICE ( )
  ;'holds' expires after its day
  IF CELLCAL_ADVICE==1 THEN
    IF $DATE.YEAR*372+$DATE.MONTH*31+$DATE.DAY>CELLCAL_ADVICE_UNTIL THEN
      CELLCAL_ADVICE=0
    ENDIF
  ENDIF
END)";

constexpr const char* kAdviceData =
    R"(;FOLD for the cell's own programs to read: what the checks of the calibration say
;0 unknown, 1 holds, 2 check again, 3 let it warm up, 4 measure the TCP again, 5 calibrate
DECL GLOBAL INT CELLCAL_ADVICE=0
;1 holds until this day: YEAR*372+MONTH*31+DAY
DECL GLOBAL INT CELLCAL_ADVICE_UNTIL=0
;ENDFOLD)";

/// Reading and setting of frames and the advice; empty parts if not configured.
krl::Places frame_places_of(const EkiFilesConfig& c) {
  const char* const kPlaces[] = {"FRAME_DATA",   "FRAME_RECEIVE", "FRAME_SEND",    "FRAME_CALL",
                                 "FRAME_FORGET", "FRAME_ANSWER",  "FRAME_PROGRAM", "FRAME_START"};
  krl::Places places;
  for (const char* place : kPlaces) places[place];
  if (!c.write_frames && !c.write_advice) return places;
  std::vector<std::string> what, cases;
  if (c.write_frames) {
    what.emplace_back("a frame of TOOL_DATA or BASE_DATA");
    cases.push_back(frame_case(1, "TOOL_DATA"));
    cases.push_back(frame_case(2, "BASE_DATA"));
  }
  if (c.write_advice) {
    what.emplace_back("CELLCAL_ADVICE");
    cases.emplace_back(kAdviceCase);
  }
  const std::string named = fmt::format("{}", fmt::join(what, ", or "));
  const auto set_int = [](std::string_view element, std::string_view value) {
    return fmt::format("  RET=EKI_SetInt(\"CellcalEki\",\"RobotState/Frame/@{}\",{})\n", element,
                       value);
  };
  const auto set_frame = [](std::string_view element, std::string_view value) {
    return per_component(fmt::format(
        "  RET=EKI_SetReal(\"CellcalEki\",\"RobotState/{}/@{{0}}\",{}.{{0}})", element, value));
  };
  const auto elements = [](std::string_view root, std::string_view type) {
    std::string text;
    for (const char* name : {"Ask", "Do", "Kind", "Number"})
      text += fmt::format("      <ELEMENT Tag=\"{}/Frame/@{}\"{}/>\n", root, name, type);
    return text;
  };
  places["FRAME_RECEIVE"] =
      elements("RobotCommand", " Type=\"INT\"") +
      per_component("      <ELEMENT Tag=\"RobotCommand/Frame/@{0}\" Type=\"REAL\"/>");
  places["FRAME_SEND"] = elements("RobotState", "") +
                         "      <ELEMENT Tag=\"RobotState/Frame/@Done\"/>\n" +
                         per_component("      <ELEMENT Tag=\"RobotState/FrameOld/@{0}\"/>") + "\n" +
                         per_component("      <ELEMENT Tag=\"RobotState/FrameNew/@{0}\"/>");
  places["FRAME_CALL"] = c.write_advice ? "  CC_FRAME ( )\n  CC_ADVICE ( )" : "  CC_FRAME ( )";
  places["FRAME_FORGET"] =
      "      ;requests of the disconnected client are discarded\n      CC_FRAME_WAIT=FALSE\n      CC_FRAME_ASK=0\n      CC_FRAME_DONE=0";
  places["FRAME_START"] = "  CC_FRAME_WAIT=FALSE\n  CC_FRAME_ASK=0\n  CC_FRAME_DONE=0";
  places["FRAME_ANSWER"] = set_int("Ask", "CC_FRAME_ASK") + set_int("Do", "CC_FRAME_DO") +
                           set_int("Kind", "CC_FRAME_KIND") + set_int("Number", "CC_FRAME_NO") +
                           set_int("Done", "CC_FRAME_DONE") +
                           set_frame("FrameOld", "CC_FRAME_OLD") + "\n" +
                           set_frame("FrameNew", "CC_FRAME_NEW");
  places["FRAME_DATA"] = without_cr(
      krl::fill(krl::template_text("cellcal_frames.dat.in"),
                {{"FRAME_WHAT", named}, {"ADVICE_DATA", c.write_advice ? kAdviceData : ""}}));
  places["FRAME_PROGRAM"] = without_cr(krl::fill(
      krl::template_text("cellcal_frames.sub.in"),
      {{"TIMER_CLOCK", fmt::to_string(c.first_timer)},
       {"FRAME_REST_MS", fmt::to_string(kFrameRestMs)},
       {"FRAME_WHAT", named},
       {"FRAME_AT_ONCE", c.write_advice ? "(CC_FRAME_KIND==3) OR " : ""},
       {"ADVICE_WHY", c.write_advice ? kAdviceWhy : ""},
       {"FRAME_NUMBERS", c.write_frames ? frame_numbers() : ""},
       {"FRAME_CASES", fmt::format("{}", fmt::join(cases, "\n"))},
       {"ADVICE_AGES", c.write_advice ? kAdviceAges : ""},
       {"GET_FRAME",
        per_component("      RET=EKI_GetReal(\"CellcalEki\",\"RobotCommand/Frame/@{0}\",AIM.{0})\n"
                      "      OK=OK AND (RET.Msg_No==0)")},
       {"FRAME_STILL", per_axis("  OK=OK AND (ABS($AXIS_ACT_MEAS.{0}-CC_FRAME_REST.{0})<0.01)",
                                c.external_axes, "", "")}}));
  return places;
}

/// As many values of each element as there are telegrams.
std::string count_elements(int external_axes) {
  constexpr const char* kCount =
      "      RET=EKI_CheckBuffer(\"CellcalEki\",\"RobotCommand/{}\")\n"
      "      OK=OK AND (RET.Buff>=COUNT)";
  std::string text;
  for (const char* element :
       {"@Session", "@Type", "@Id", "Move/@Guard", "Move/@Path", "Move/@Percent", "Move/@Duration"})
    text += fmt::format(kCount, element) + '\n';
  return text + per_axis(fmt::format(kCount, "{1}/@{0}"), external_axes, "Axis", "Ext");
}

krl::Places places_of(const EkiFilesConfig& c) {
  const auto axes = [&](std::string_view form, std::string_view first = "Axis",
                        std::string_view external = "Ext") {
    return per_axis(form, c.external_axes, first, external);
  };
  const auto text = [](int value) { return fmt::to_string(value); };
  krl::Places places = {
      {"VERSION", krl::release()},
      {"ADDRESS", c.address},
      {"PORT", text(c.port)},
      {"BUFFER_LIMIT", text(kBufferLimit)},
      {"ALIVE_FLAG", text(c.alive_flag)},
      {"STOP_FLAG", text(c.stop_flag)},
      {"INPUT", text(c.input)},
      {"CONTACT", c.contact_is_on ? "TRUE" : "FALSE"},
      {"CONTACT_BIT", fmt::format("{}$IN[{}]", c.contact_is_on ? "" : "NOT ", c.input)},
      {"TOOL_VALUE", number_or("TOOL_DATA", c.tool, "$NULLFRAME")},
      {"BASE_VALUE", number_or("BASE_DATA", c.base, "$NULLFRAME")},
      {"LOAD_VALUE",
       number_or("LOAD_DATA", c.load,
                 "{M -1.0,CM {X 0.0,Y 0.0,Z 0.0,A 0.0,B 0.0,C 0.0},J {X 0.0,Y 0.0,Z 0.0}}")},
      {"ACC_AXIS", text(c.acceleration_percent)},
      {"EXTERNAL_SPEEDS", external_speeds(c)},
      {"EXTERNAL_HOLD", external_hold(c.external_axes)},
      {"ACC_CP", kAccCp},
      {"LIN_LIMIT", kLinLimit},
      {"INTERRUPT_INPUT", text(c.first_interrupt)},
      {"INTERRUPT_FLAG", text(c.first_interrupt + 1)},
      {"INTERRUPT_TIMER", text(c.first_interrupt + 2)},
      {"TIMER_CLOCK", text(c.first_timer)},
      {"TIMER_SEND", text(c.first_timer + 1)},
      {"TIMER_DEAD", text(c.first_timer + 2)},
      {"STATE_MS", text(c.state_ms)},
      {"LOOK_STATES", text(kChannelCheckMs / c.state_ms)},
      {"DEAD_MAN_MS", text(c.dead_man_ms)},
      {"ECHO_STATES", text(std::max(3, kEchoMs / c.state_ms))},
      {"WAIT_MS", text(c.cell_wait_s * 1000)},
      {"MAY_RUN", c.may_run ? "TRUE" : "FALSE"},
      {"REQUESTS", requests(c)},
      {"RECEIVE_AXES", axes("      <ELEMENT Tag=\"RobotCommand/{1}/@{0}\" Type=\"REAL\"/>")},
      {"COUNT_ELEMENTS", count_elements(c.external_axes)},
      {"SEND_AXES", axes("      <ELEMENT Tag=\"RobotState/{1}/@{0}\"/>")},
      {"SEND_POS", per_component("      <ELEMENT Tag=\"RobotState/Pos/@{0}\"/>")},
      {"SET_POS",
       per_component("  RET=EKI_SetReal(\"CellcalEki\",\"RobotState/Pos/@{0}\",CC_TCP.{0})")},
      {"SEND_LATCH", axes("      <ELEMENT Tag=\"RobotState/{1}/@{0}\"/>", "Latch", "LatchExt")},
      {"GET_AXES", axes("    RET=EKI_GetReal(\"CellcalEki\",\"RobotCommand/{1}/@{0}\",AIM.{0})\n"
                        "    OK=OK AND (RET.Msg_No==0)")},
      {"SET_AXES",
       axes("  RET=EKI_SetReal(\"CellcalEki\",\"RobotState/{1}/@{0}\",$AXIS_ACT_MEAS.{0})")},
      {"SET_LATCH", axes("  RET=EKI_SetReal(\"CellcalEki\",\"RobotState/{1}/@{0}\",CC_LATCH.{0})",
                         "Latch", "LatchExt")},
      {"SOFT_LIMITS", axes("  OK=OK AND (CC_TARGET.{0}>=$SOFTN_END[{2}]) AND "
                           "(CC_TARGET.{0}<=$SOFTP_END[{2}])")},
  };
  places.merge(frame_places_of(c));
  return places;
}

}  // namespace

void EkiFilesConfig::validate() const {
  if (address.empty()) throw ConfigError("controller files: address is empty");
  for (const char c : address) {
    if ((c < '0' || c > '9') && c != '.') {
      throw ConfigError(fmt::format(
          "controller files: address = \"{}\" is not an IPv4 address, which EKI needs", address));
    }
  }
  check("port", port, 1, 65535);
  check("external_axes", external_axes, 0, 6);
  check("input", input, 1, 8192);
  check("tool", tool, 0, 128);
  check("base", base, 0, 128);
  check("load", load, 0, 128);
  check("acceleration_percent", acceleration_percent, 1, 100);
  check("alive_flag", alive_flag, 1, 1024);
  check("stop_flag", stop_flag, 1, 1024);
  check("first_timer", first_timer, 1, 62);
  // Three consecutive priorities; 3 and 40..80 are reserved by the controller.
  const bool low = first_interrupt >= 4 && first_interrupt + 2 <= 39;
  const bool high = first_interrupt >= 81 && first_interrupt + 2 <= 128;
  if (!low && !high) {
    throw ConfigError(
        fmt::format("controller files: first_interrupt = {} must be 4 to 37 or 81 to 126: three "
                    "priorities are used from it on, all in 4..39 or in 81..128",
                    first_interrupt));
  }
  check("state_ms", state_ms, 12, 100);
  check("dead_man_ms", dead_man_ms, 100, 1000);
  check("cell_wait_s", cell_wait_s, 10, 7200);
  check("brake_test_output", brake_test_output, 0, 8192);
  check("mastering_test_output", mastering_test_output, 0, 8192);
  check("collision_output", collision_output, 0, 8192);
  if (alive_flag == stop_flag) {
    throw ConfigError(fmt::format(
        "controller files: alive_flag and stop_flag are both {}: use two different flags",
        alive_flag));
  }
}

ControllerFiles eki_files(const EkiFilesConfig& config) {
  config.validate();
  const krl::Places places = places_of(config);
  ControllerFiles files;
  for (const char* name : {"CellcalEki.xml", "cellcal_eki.src", "cellcal_eki.dat",
                           "cellcal_sub.sub", "cellcal_loop.sub"}) {
    files[name] = krl::fill(krl::template_text(std::string(name) + ".in"), places);
  }
  return files;
}

}  // namespace cellcal::drivers
