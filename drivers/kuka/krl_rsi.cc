// RSI's set of controller files.

#include <fmt/format.h>

#include <string_view>
#include <vector>

#include "drivers/error.h"
#include "drivers/kuka/krl_files.h"
#include "drivers/kuka/krl_rsi_drawing.h"
#include "drivers/kuka/krl_template.h"

namespace cellcal::drivers {
namespace {

constexpr int kAxes = 6;

/// One line per axis, {0} from 1 to 6, {1} its place in a list that begins at `first`.
std::string per_axis(std::string_view form, int first) {
  std::string text;
  for (int i = 0; i < kAxes; ++i) {
    if (i > 0) text += '\n';
    text += fmt::format(fmt::runtime(form), i + 1, first + i);
  }
  return text;
}

/// Whole: what is rounded down would clamp before the adapter does.
std::string degrees(double value) {
  const std::string text = fmt::to_string(value);
  return text.find('.') == std::string::npos ? text + ".0" : text;
}

/// RSI 3 numbers from 1 and leaves six numbers to the external axes, RSI 4 counts on from 0.
std::string limits(const char* form, double limit_deg, int lower_from, int upper_from) {
  std::string text;
  for (const bool upper : {false, true}) {
    for (int i = 0; i < kAxes; ++i) {
      if (!text.empty()) text += '\n';
      text += fmt::format(fmt::runtime(form), upper ? "UpperLimA" : "LowerLimA", i + 1,
                          (upper ? upper_from : lower_from) + i,
                          degrees(upper ? limit_deg : -limit_deg));
    }
  }
  return text;
}

std::string monitor(const char* form, double limit_deg, int from) {
  std::string text;
  for (int i = 0; i < kAxes; ++i) {
    if (i > 0) text += '\n';
    text += fmt::format(fmt::runtime(form), "MaxA", i + 1, from + i, degrees(limit_deg));
  }
  // External axes are not driven: what the object has by itself.
  for (int i = 0; i < kAxes; ++i) {
    text += '\n' + fmt::format(fmt::runtime(form), "MaxE", i + 1, from + kAxes + i, "6.0");
  }
  return text;
}

krl::Places places_of(const RsiFilesConfig& c) {
  const char* const kRsi3 = "      <Parameter Name=\"{}{}\" ParamID=\"{}\" ParamValue=\"{}\"/>";
  const char* const kRsi4 = "        <Parameter Name=\"{}{}\" ParamId=\"{}\" ParamValue=\"{}\"/>";
  const char* const kModel =
      "        <rSIParameter name=\"{0}{1}\" value=\"{3}\" paramType=\"System.Double\" "
      "minVal=\"-2147483648\" maxVal=\"2147483647\" isEnum=\"false\" index=\"{2}\" />";
  const char* const kModelMonitor =
      "        <rSIParameter name=\"{0}{1}\" value=\"{3}\" paramType=\"System.Double\" "
      "minVal=\"0\" maxVal=\"2147483647\" isEnum=\"false\" index=\"{2}\" />";
  const auto number_or = [](const char* array, int number, const char* otherwise) {
    return number == 0 ? std::string(otherwise) : fmt::format("{}[{}]", array, number);
  };
  const bool absolute = c.mode == CorrectionMode::kAbsolute;
  const std::string hold_on = absolute ? "1" : "0";
  return {
      {"VERSION", krl::release()},
      {"RSI_MODE", absolute ? "#ABSOLUTE" : "#RELATIVE"},
      {"HOLD_ON", hold_on},
      {"LATE_REPLY", absolute ? "makes the arm hold" : "is a step that is lost, not one repeated"},
      {"PC_ADDRESS", c.pc_address},
      {"RSI_PORT", fmt::to_string(c.port)},
      {"SENTYPE", c.sentype},
      {"STOP_TAG", c.stop_tag},
      {"RSI_AXES", per_axis("      <ELEMENT TAG=\"" + c.axis_tag +
                                ".A{0}\" TYPE=\"DOUBLE\" INDX=\"{0}\" HOLDON=\"" + hold_on + "\"/>",
                            1)},
      {"RSI_TIMEOUT", fmt::to_string(c.timeout_cycles)},
      {"ALIVE_FLAG", fmt::to_string(c.flag)},
      {"RSI_CONTEXT", c.rsi_version == 3 ? "cellcal_rsi.rsi" : "cellcal_rsi"},
      {"RSI3_INPUTS",
       per_axis("      <Input InIdx=\"{0}\" OutObjID=\"ETHERNET1\" OutIdx=\"{0}\"/>", 1)},
      {"RSI4_INPUTS",
       per_axis("        <Input InIdx=\"{1}\" OutObjId=\"Ethernet_1\" OutIdx=\"{1}\"/>", 0)},
      {"RSI3_LIMITS", limits(kRsi3, c.correction_limit_deg, 1, 13)},
      {"RSI4_LIMITS", limits(kRsi4, c.correction_limit_deg, 0, 6)},
      {"RSI3_MONITOR", monitor(kRsi3, c.correction_limit_deg, 1)},
      {"RSI4_MONITOR", monitor(kRsi4, c.correction_limit_deg, 0)},
      {"MODEL_CHANNELS", per_axis("        <rSIOutPort name=\"Out{0}\" />", 1) +
                             "\n        <rSIOutPort name=\"Out7\" />"},
      {"MODEL_INPUTS",
       per_axis("        <rSIInPort name=\"CorrA{0}\" mandatory=\"false\">\n          <source>\n"
                "            <rSIOutPortMoniker name=\"//ETHERNET1/Out{0}\" />\n"
                "          </source>\n        </rSIInPort>",
                1)},
      {"MODEL_AXES", per_axis("        <rSIOutPort name=\"A{0}\" />", 1)},
      {"MODEL_EXTERNAL", per_axis("        <rSIOutPort name=\"E{0}\" />", 1)},
      {"MODEL_LIMITS", limits(kModel, c.correction_limit_deg, 1, 13)},
      {"MODEL_MONITOR", monitor(kModelMonitor, c.correction_limit_deg, 1)},
      {"TOOL_VALUE", number_or("TOOL_DATA", c.tool, "$NULLFRAME")},
      {"BASE_VALUE", number_or("BASE_DATA", c.base, "$NULLFRAME")},
      {"LOAD_VALUE",
       number_or("LOAD_DATA", c.load,
                 "{M -1.0,CM {X 0.0,Y 0.0,Z 0.0,A 0.0,B 0.0,C 0.0},J {X 0.0,Y 0.0,Z 0.0}}")},
  };
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
        "controller files: pc_address is not stated, and bind of [rsi] is \"0.0.0.0\", which means "
        "'every address of this computer': the controller needs the one that it is to send to. "
        "Write "
        "pc_address = \"A.B.C.D\" below [controller] of the daemon's configuration, with this "
        "computer's address in the controller's RSI subnet ('ip -4 address' lists them)");
  }
  if (!digits || dots != 3) {
    throw ConfigError(fmt::format(
        "controller files: pc_address = \"{}\" is not the IPv4 address of this computer in the "
        "controller's RSI subnet",
        pc_address));
  }
  if (pc_address.starts_with("192.168.0.") || pc_address.starts_with("192.0.1.")) {
    throw ConfigError(fmt::format(
        "controller files: pc_address = \"{}\" is in a subnet that the controller keeps for itself "
        "(192.168.0.x, 192.0.1.x): give RSI's interface and this computer another one",
        pc_address));
  }
  if (rsi_version != 3 && rsi_version != 4) {
    throw ConfigError(fmt::format(
        "controller files: rsi_version = {} is neither 3 (KSS 8.2 to 8.4) nor 4 (KSS 8.5 and on)",
        rsi_version));
  }
  check_name("sentype", sentype);
  check_name("axis_tag", axis_tag);
  check_name("stop_tag", stop_tag);
  check_number("port", port, 1, 65535);
  check_number("timeout_cycles", timeout_cycles, 1, 1000);
  check_number("flag", flag, 1, 999);
  check_number("correction_limit_deg", correction_limit_deg, 0.1, 360.0);
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
    files["cellcal_rsi.rsi.diagram"] = krl::fill(krl::rsi3_diagram(), {});
  } else {
    names.emplace_back("cellcal_rsi.rsix");
  }
  for (const std::string& name : names) {
    files[name] = krl::fill(krl::template_text(name + ".in"), places);
  }
  return files;
}

}  // namespace cellcal::drivers
