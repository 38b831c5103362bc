// Generator of RSI's controller files.

#include "drivers/kuka/krl/krl_rsi.h"

#include <fmt/format.h>

#include <string_view>
#include <vector>

#include "drivers/error.h"
#include "drivers/kuka/krl/krl_files.h"
#include "drivers/kuka/krl/krl_rsi_parts.h"
#include "drivers/kuka/wire/xml_values.h"

namespace cellcal::drivers {

namespace {

using krl::decimal;

constexpr int kRsiAxes = 6;

/// The six values of a correction: "A1" to "A6", or "X" to "C" in space.
std::string name_of(const RsiFilesConfig& c, int i) {
  return c.space.on ? std::string(wire::kFrameNames.substr(static_cast<std::size_t>(i), 1))
                    : fmt::format("A{}", i + 1);
}

/// One line per value: {0} from 1 to 6, {1} its index in a list that starts at `first`, {2} its
/// name.
std::string per_value(const RsiFilesConfig& c, std::string_view form, int first) {
  std::string text;
  for (int i = 0; i < kRsiAxes; ++i) {
    if (i > 0) text += '\n';
    text += fmt::format(fmt::runtime(form), i + 1, first + i, name_of(c, i));
  }
  return text;
}

/// RSI 3 numbers from 1 and reserves six numbers for the external axes; RSI 4 continues from 0. In
/// space only the shift has limits of its own.
std::string limits(const RsiFilesConfig& c, const std::string& form, int from) {
  const double limit = c.space.on ? c.space.limit_mm : c.correction_limit_deg;
  const int count = c.space.on ? 3 : kRsiAxes;
  const int upper_from = from + (c.space.on ? 3 : from == 1 ? 2 * kRsiAxes : kRsiAxes);
  std::string text;
  for (const bool upper : {false, true}) {
    for (int i = 0; i < count; ++i) {
      if (!text.empty()) text += '\n';
      text += fmt::format(fmt::runtime(form), upper ? "UpperLim" : "LowerLim", name_of(c, i),
                          (upper ? upper_from : from) + i, decimal(upper ? limit : -limit));
    }
  }
  return text;
}

std::string monitor(const RsiFilesConfig& c, const std::string& form, int from) {
  std::string text;
  for (int i = 0; i < kRsiAxes; ++i) {
    if (i > 0) text += '\n';
    text +=
        fmt::format(fmt::runtime(form), "MaxA", i + 1, from + i, decimal(c.correction_limit_deg));
  }
  // The object's default for external axes that are not driven.
  for (int i = 0; i < kRsiAxes; ++i) {
    const auto axis = static_cast<std::size_t>(i);
    text += '\n' +
            fmt::format(fmt::runtime(form), "MaxE", i + 1, from + kRsiAxes + i,
                        axis < c.external.size() ? decimal(travel_limit(c.external[axis])) : "6.0");
  }
  return text;
}

/// The template of a part, to be inserted into a whole file.
std::string part(const std::string& name, const krl::Places& places) {
  std::string text = krl::fill(krl::template_text(name), places);
  std::erase(text, '\r');
  if (!text.empty()) text.pop_back();
  return text;
}

/// The narrower limits set by the program at each start; the program ends if that fails.
constexpr const char* kFenceCall =
    R"(  ;narrower limits than the context's, which are the same for all axes and on both sides
  IF CC_FENCE({})==FALSE THEN
    ;the arm is beyond one of the limits, or RSI has refused one
    LOOP
      HALT
    ENDLOOP
  ENDIF)";

/// RSI 6 requires activation of a loaded context.
constexpr const char* kActivate =
    R"(  RET=RSI_ACTIVATE("cellcal_rsi")
  IF RET<>RSIOK THEN
    LOOP
      HALT
    ENDLOOP
  ENDIF)";

/// CC_LOW and CC_HIGH: the limits of an axis by its greatest correction, its switches and its range.
std::string fence_ends(krl::Places places, const std::string& ending, double limit,
                       const char* limit_key) {
  places["OF_AXIS"] = ending;
  places["CORRECTION_LIMIT"] = decimal(limit);
  places["LIMIT_KEY"] = limit_key;
  return '\n' + part("fence_ends.src.in", places);
}

void add_fence(const RsiFilesConfig& c, krl::Places& places) {
  const bool six = c.rsi_version == 6;
  places["FENCE_CALL"] = c.space.on ? "" : fmt::format(kFenceCall, six ? " " : "CONTID");
  places["FENCE_PARAMETER"] = six ? " " : "CONTID :IN ";
  places["FENCE_NUMBER"] = six ? "" : "  DECL INT CONTID";
  places["FENCE_AXES"] = krl::fence_axes(c);
  places["FENCE"] =
      c.space.on ? ""
                 : part("fence.src.in", places) +
                       fence_ends(places, "", c.correction_limit_deg, "correction_limit_deg");
  for (std::size_t i = 0; i < c.external.size(); ++i)
    places["FENCE"] += fence_ends(
        places, krl::travel_fence(i), travel_limit(c.external[i]),
        c.external[i].linear ? "the linear unit's stroke" : "the range of the positioner's axis");
}

/// Names of RSI's calls, and destination of its files.
void add_release(const RsiFilesConfig& c, krl::Places& places) {
  const bool six = c.rsi_version == 6;
  const std::string mode = c.mode == CorrectionMode::kAbsolute ? "#ABSOLUTE" : "#RELATIVE";
  const char* const context = c.rsi_version == 3 ? "cellcal_rsi.rsi" : "cellcal_rsi";
  const std::pair<const char*, std::string> pairs[] = {
      {"RSI_MODE", (six ? "RSI_PROCESS_ON(" : "RSI_ON(") + mode + ")"},
      {"RSI_ON", six ? "RSI_PROCESS_ON(" + mode + ")" : "RSI_ON(" + mode + ",#IPO_FAST)"},
      {"RSI_OFF", six ? "RSI_PROCESS_OFF()" : "RSI_OFF()"},
      {"CONTEXT_NUMBER", six ? "" : "DECL INT CONTID"},
      {"RSI_RESET", six ? "" : "  ;contexts left by an earlier run\n  RET=RSI_RESET()"},
      {"RSI_LOAD",
       fmt::format(fmt::runtime(six ? "RSI_LOAD(\"{}\")" : "RSI_CREATE(\"{}\",CONTID,TRUE)"),
                   context)},
      {"RSI_ACTIVATE", six ? kActivate : ""},
      {"RSI_DELETE", six ? "" : "  RET=RSI_DELETE(CONTID)"},
      {"RSI_PLACE", six ? "Ethernet configurations of iiQKA.RobotSensorInterface (iiQWorks.Sim)"
                        : R"(C:\KRC\ROBOTER\Config\User\Common\SensorInterface)"},
      {"RSI4_RELEASES", six ? "RSI 6 (iiQKA.OS2)" : "RSI 4 and 5 (KSS 8.5 and on)"},
      {"STOP_SIGNAL", six ? " SignalName=\"Ethernet_1|Out7\"" : ""}};
  for (const auto& [name, text] : pairs) places[name] = text;
}

void add_correction(const RsiFilesConfig& c, krl::Places& places) {
  constexpr std::pair<const char*, const char*> kFrames[] = {
      {"1", "Base"}, {"2", "RobRoot"}, {"3", "Tool"}};
  const auto& [number, name] = kFrames[static_cast<std::size_t>(c.space.frame)];
  places["FRAME_NUMBER"] = number;
  places["FRAME_NAME"] = name;
  places["SHIFT_LIMIT"] = decimal(c.space.limit_mm);
  places["TURN_LIMIT"] = decimal(c.space.turn_limit_deg);
  const std::string kind = c.space.on ? "space" : "axes";
  places["RSI3_CORRECTION"] = part(kind + ".rsi.xml.in", places);
  places["RSI4_CORRECTION"] = part(kind + ".rsix.in", places);
  places["MODEL_CORRECTION"] = part(kind + ".rsi.in", places);
}

/// For limits: {0}{1} their name, {2} their number, {3} their value.
std::string context_parameter(bool three, const char* attributes) {
  return fmt::format("{}<Parameter {}Name=\"{{}}{{}}\" {}=\"{{}}\" ParamValue=\"{{}}\"/>",
                     three ? "      " : "        ", attributes, three ? "ParamID" : "ParamId");
}
std::string model_parameter(const char* least, const char* attributes) {
  return fmt::format(
      "        <rSIParameter name=\"{{0}}{{1}}\" value=\"{{3}}\" paramType=\"System.Double\" "
      "minVal=\"{}\" maxVal=\"2147483647\" isEnum=\"false\" {}index=\"{{2}}\" />",
      least, attributes);
}

/// The fence sets the limits of the axes from the program, which requires them to be public.
void add_limits(const RsiFilesConfig& c, krl::Places& places) {
  const char* const open = c.space.on ? "" : "IsPublic=\"true\" ";
  const char* const open_model = c.space.on ? "" : "isPublic=\"true\" ";
  const char* const fixed = c.rsi_version == 6 ? "IsRuntime=\"false\" " : "";
  places["FIXED"] = fixed;
  places["RSI3_LIMITS"] = limits(c, context_parameter(true, open), 1);
  places["RSI4_LIMITS"] = limits(c, context_parameter(false, open), 0);
  places["RSI3_MONITOR"] = monitor(c, context_parameter(true, ""), 1);
  places["RSI4_MONITOR"] = monitor(c, context_parameter(false, fixed), 0);
  places["MODEL_LIMITS"] = limits(c, model_parameter("-2147483648", open_model), 1);
  places["MODEL_MONITOR"] = monitor(c, model_parameter("0", ""), 1);
}

krl::Places places_of(const RsiFilesConfig& c) {
  const auto number_or = [](const char* array, int number, const char* otherwise) {
    return number == 0 ? std::string(otherwise) : fmt::format("{}[{}]", array, number);
  };
  const bool absolute = c.mode == CorrectionMode::kAbsolute;
  const std::string hold_on = absolute ? "1" : "0";
  krl::Places places{
      {"VERSION", krl::release()},
      {"HOLD_ON", hold_on},
      {"LATE_REPLY", absolute ? "makes the arm hold" : "is a step that is lost, not one repeated"},
      {"PC_ADDRESS", c.pc_address},
      {"RSI_PORT", fmt::to_string(c.port)},
      {"SENTYPE", c.sentype},
      {"STOP_TAG", c.stop_tag},
      {"RSI_AXES", per_value(c,
                             "      <ELEMENT TAG=\"" + (c.space.on ? c.space.tag : c.axis_tag) +
                                 ".{2}\" TYPE=\"DOUBLE\" INDX=\"{0}\" HOLDON=\"" + hold_on + "\"/>",
                             1)},
      {"RSI_TIMEOUT", fmt::to_string(c.timeout_cycles)},
      {"ALIVE_FLAG", fmt::to_string(c.flag)},
      {"RSI3_INPUTS",
       per_value(c, "      <Input InIdx=\"{0}\" OutObjID=\"ETHERNET1\" OutIdx=\"{0}\"/>", 1)},
      {"RSI4_INPUTS",
       per_value(
           c,
           std::string("        <Input InIdx=\"{1}\" OutObjId=\"Ethernet_1\" OutIdx=\"{1}\"") +
               (c.rsi_version == 6 ? " SignalName=\"Ethernet_1|Out{0}\"/>" : "/>"),
           0)},
      {"MODEL_CHANNELS", per_value(c, "        <rSIOutPort name=\"Out{0}\" />", 1) +
                             "\n        <rSIOutPort name=\"Out7\" />"},
      {"MODEL_INPUTS",
       per_value(c,
                 "        <rSIInPort name=\"Corr{2}\" mandatory=\"false\">\n          <source>\n"
                 "            <rSIOutPortMoniker name=\"//ETHERNET1/Out{0}\" />\n"
                 "          </source>\n        </rSIInPort>",
                 1)},
      {"MODEL_AXES", per_value(c, "        <rSIOutPort name=\"A{0}\" />", 1)},
      {"MODEL_FRAME", per_value(c, "        <rSIOutPort name=\"{2}\" />", 1)},
      {"MODEL_EXTERNAL", per_value(c, "        <rSIOutPort name=\"E{0}\" />", 1)},
      {"TOOL_VALUE", number_or("TOOL_DATA", c.tool, "$NULLFRAME")},
      {"BASE_VALUE", number_or("BASE_DATA", c.base, "$NULLFRAME")},
      {"LOAD_VALUE",
       number_or("LOAD_DATA", c.load,
                 "{M -1.0,CM {X 0.0,Y 0.0,Z 0.0,A 0.0,B 0.0,C 0.0},J {X 0.0,Y 0.0,Z 0.0}}")},
  };
  add_limits(c, places);
  add_release(c, places);
  add_correction(c, places);
  krl::add_travel(c, places);
  add_fence(c, places);
  krl::add_state(c, places);
  return places;
}

void check_name(const char* key, const std::string& name) {
  bool fine = !name.empty() && name.size() <= 32;
  for (const char c : name) {
    fine = fine &&
           ((c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_');
  }
  if (!fine || (name.front() >= '0' && name.front() <= '9')) {
    throw ConfigError(fmt::format(
        "controller files: {} = \"{}\" is not a name of letters, digits and '_'", key, name));
  }
}

/// "Element.Attribute", or "Element" for its text; empty: not sent.
void check_sent_name(const char* key, const std::string& name) {
  if (name.empty()) return;
  const std::size_t dot = name.find('.');
  check_name(key, name.substr(0, dot));
  if (dot != std::string::npos) check_name(key, name.substr(dot + 1));
}

void check_number(const char* key, double value, double low, double high) {
  if (!(value >= low && value <= high)) {
    throw ConfigError(
        fmt::format("controller files: {} = {} is outside {}..{}", key, value, low, high));
  }
}

}  // namespace

void RsiFilesConfig::validate() const {
  int dots = 0;
  bool digits = !pc_address.empty();
  for (const char c : pc_address) {
    dots += c == '.';
    digits = digits && (c == '.' || (c >= '0' && c <= '9'));
  }
  if (pc_address.empty() || pc_address == "0.0.0.0") {
    throw ConfigError(
        "controller files: pc_address is missing: bind = \"0.0.0.0\" of [rsi] means every "
        "address, but the controller sends to one. Below [controller] of the daemon's "
        "configuration write pc_address = \"A.B.C.D\" with this computer's address in the "
        "controller's RSI subnet ('ip -4 address' lists them)");
  }
  if (!digits || dots != 3) {
    throw ConfigError(fmt::format(
        "controller files: pc_address = \"{}\" is not the IPv4 address of this computer in the "
        "controller's RSI subnet",
        pc_address));
  }
  const auto within = [&](const char* subnet) { return pc_address.starts_with(subnet); };
  if (within("192.168.0.") || within("192.0.1.") || within("172.16.") || within("172.17.")) {
    throw ConfigError(fmt::format(
        "controller files: pc_address = \"{}\" is in a subnet that the controller uses itself "
        "(192.168.0.x, 192.0.1.x, 172.16.x.x, 172.17.x.x). Use another subnet for RSI's "
        "interface and this computer",
        pc_address));
  }
  if (!is_rsi_version(rsi_version)) {
    throw ConfigError(fmt::format("controller files: rsi_version = {} is not one of {}",
                                  rsi_version, kRsiVersions));
  }
  check_name("sentype", sentype);
  check_name("axis_tag", axis_tag);
  check_name("external_axis_tag", external_axis_tag);
  check_name("stop_tag", stop_tag);
  check_sent_name("mode_tag", mode_tag);
  check_sent_name("override_tag", override_tag);
  check_sent_name("contact_tag", contact_tag);
  check_number("input", input, 1, 8192);
  if (space.on) {
    check_name("cart_tag", space.tag);
    check_number("correction_limit_mm", space.limit_mm, 1.0, 5000.0);
    check_number("correction_turn_limit_deg", space.turn_limit_deg, 0.1, 180.0);
    if (mode == CorrectionMode::kRelative) {
      throw ConfigError(
          "controller files: correction = \"space\" is not possible with mode RELATIVE. Use "
          "mode = \"absolute\"");
    }
  }
  check_number("external_axes", external_axes, static_cast<double>(external.size()), 6);
  for (std::size_t i = 0; i < external.size(); ++i)
    check_number(fmt::format("E{}'s range", i + 1).c_str(), travel_limit(external[i]), 1.0,
                 200'000.0);
  if (!external.empty() && space.on)
    throw ConfigError(
        "controller files: correction = \"space\" drives six axes, and neither a linear unit nor a "
        "positioner. Use correction = \"axes\"");
  check_number("port", port, 1, 65535);
  check_number("timeout_cycles", timeout_cycles, 1, 1000);
  check_number("flag", flag, 1, 999);
  check_number("correction_limit_deg", correction_limit_deg, 0.1, 360.0);
  if (!ranges_deg.empty() && ranges_deg.size() < static_cast<std::size_t>(kRsiAxes)) {
    throw ConfigError(
        fmt::format("controller files: ranges of {} axes, RSI corrects six", ranges_deg.size()));
  }
  check_number("tool", tool, 0, 128);
  check_number("base", base, 0, 128);
  check_number("load", load, 0, 128);
}

ControllerFiles rsi_files(const RsiFilesConfig& config) {
  config.validate();
  const krl::Places places = places_of(config);
  ControllerFiles files;
  std::vector<std::string> names{"cellcal_rsi.src", "cellcal_rsi_ethernet.xml"};
  if (config.rsi_version == 3) {
    names.insert(names.end(), {"cellcal_rsi.rsi", "cellcal_rsi.rsi.xml"});
    files["cellcal_rsi.rsi.diagram"] = krl::fill(krl::rsi3_diagram(config), {});
  } else {
    names.emplace_back("cellcal_rsi.rsix");
  }
  for (const std::string& name : names) {
    files[name] = krl::fill(krl::template_text(name + ".in"), places);
  }
  return files;
}

}  // namespace cellcal::drivers
