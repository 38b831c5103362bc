// Generator of RSI's controller files.

#include "drivers/kuka/krl/krl_rsi.h"

#include <fmt/format.h>

#include <string_view>
#include <vector>

#include "drivers/error.h"
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

/// A number of the context by its name, with its numbers in RSI 3 and from RSI 4 on.
krl::Places parameter(const std::string& name, int id3, int id4, const std::string& value) {
  return {
      {"NAME", name}, {"ID3", fmt::to_string(id3)}, {"ID4", fmt::to_string(id4)}, {"VALUE", value}};
}

/// RSI 3 numbers from 1 and reserves six numbers for the external axes; RSI 4 continues from 0. In
/// space only the shift has limits of its own.
std::vector<krl::Places> limits(const RsiFilesConfig& c) {
  const double limit = c.space.on ? c.space.limit_mm : c.correction_limit_deg;
  const int count = c.space.on ? 3 : kRsiAxes;
  std::vector<krl::Places> all;
  for (const bool upper : {false, true})
    for (int i = 0; i < count; ++i)
      all.push_back(parameter((upper ? "UpperLim" : "LowerLim") + name_of(c, i),
                              1 + i + (upper ? c.space.on ? 3 : 2 * kRsiAxes : 0),
                              i + (upper ? count : 0), decimal(upper ? limit : -limit)));
  return all;
}

std::vector<krl::Places> monitor(const RsiFilesConfig& c) {
  std::vector<krl::Places> all;
  for (int k = 0; k < 2 * kRsiAxes; ++k) {
    const bool own = k < kRsiAxes;
    const auto axis = static_cast<std::size_t>(k % kRsiAxes);
    // The object's default for external axes that are not driven.
    const std::string most = own                        ? decimal(c.correction_limit_deg)
                             : axis < c.external.size() ? decimal(travel_limit(c.external[axis]))
                                                        : "6.0";
    all.push_back(parameter(fmt::format("{}{}", own ? "MaxA" : "MaxE", axis + 1), k + 1, k, most));
  }
  return all;
}

/// RSI 3 numbers the inputs and limits of AXISCORREXT after those of AXISCORR, RSI 4 from 0.
void add_travel(const RsiFilesConfig& c, krl::Lists& lists) {
  constexpr int kUpper3 = 19, kUpper4 = 6;
  const int count = static_cast<int>(c.external.size());
  std::vector<krl::Places>&corrected = lists["TRAVEL"], &limits = lists["TRAVEL_LIMIT"];
  for (int i = 0; i < count; ++i)
    corrected.push_back({{"N", fmt::to_string(i + 1)},
                         {"INDEX", fmt::to_string(i)},
                         {"TAG", krl::travel_tag(c, static_cast<std::size_t>(i))},
                         {"INPUT", fmt::to_string(kRsi3ExternalInput + i)},
                         {"CHANNEL", fmt::to_string(krl::kTravelChannel + i)},
                         {"OUTPUT", fmt::to_string(krl::kTravelChannel - 1 + i)},
                         {"SIGNAL", krl::signal_of(c, krl::kTravelChannel + i)}});
  for (const bool upper : {false, true})
    for (int i = 0; i < count; ++i) {
      const double limit = travel_limit(c.external[static_cast<std::size_t>(i)]);
      limits.push_back(parameter(fmt::format("{}LimE{}", upper ? "Upper" : "Lower", i + 1),
                                 (upper ? kUpper3 : kRsi3ExternalInput) + i,
                                 (upper ? kUpper4 : 0) + i, decimal(upper ? limit : -limit)));
    }
  lists["ANY_TRAVEL"] = krl::once_if(count > 0);
}

/// CC_LOW and CC_HIGH of an axis: by its greatest correction, its switches and its range.
krl::Places fence_end(const std::string& ending, double limit, const char* limit_key) {
  return {{"OF_AXIS", ending}, {"CORRECTION_LIMIT", decimal(limit)}, {"LIMIT_KEY", limit_key}};
}

/// The narrower limits set by the program at each start; the program ends if that fails.
void add_fence(const RsiFilesConfig& c, krl::Lists& lists) {
  lists["FENCED"] = krl::once_if(!c.space.on);
  std::vector<krl::Places>&limits = lists["FENCE_LIMIT"], &ends = lists["FENCE_END"];
  for (const krl::FenceLimit& one : krl::fence_limits(c))
    limits.push_back({{"VALUE", one.value},
                      {"OBJECT", one.object},
                      {"PARAMETER", one.parameter},
                      {"SIGN", one.lower ? "<=" : ">="}});
  ends.push_back(fence_end("", c.correction_limit_deg, "correction_limit_deg"));
  for (std::size_t i = 0; i < c.external.size(); ++i)
    ends.push_back(fence_end(
        krl::travel_fence(i), travel_limit(c.external[i]),
        c.external[i].linear ? "the linear unit's stroke" : "the range of the positioner's axis"));
}

krl::Lists lists_of(const RsiFilesConfig& c) {
  krl::Lists lists = {{"LIMIT", limits(c)},
                      {"MONITOR", monitor(c)},
                      {"ANY_EXTERNAL", krl::once_if(c.external_axes > 0)},
                      {"BEFORE_6", krl::once_if(c.rsi_version != 6)},
                      // RSI 6 requires activation of a loaded context.
                      {"FROM_6", krl::once_if(c.rsi_version == 6)}};
  for (int i = 0; i < kRsiAxes; ++i)
    lists["VALUE"].push_back({{"N", fmt::to_string(i + 1)},
                              {"INDEX", fmt::to_string(i)},
                              {"NAME", name_of(c, i)},
                              {"SIGNAL", krl::signal_of(c, i + 1)}});
  add_travel(c, lists);
  add_fence(c, lists);
  lists["STATE"] = krl::state_places(c);
  lists["ANY_STATE"] = krl::once_if(!lists["STATE"].empty());
  return lists;
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
      {"RSI_LOAD",
       fmt::format(fmt::runtime(six ? "RSI_LOAD(\"{}\")" : "RSI_CREATE(\"{}\",CONTID,TRUE)"),
                   context)},
      {"RSI_PLACE", six ? "Ethernet configurations of iiQKA.RobotSensorInterface (iiQWorks.Sim)"
                        : R"(C:\KRC\ROBOTER\Config\User\Common\SensorInterface)"},
      {"RSI4_RELEASES", six ? "RSI 6 (iiQKA.OS2)" : "RSI 4 and 5 (KSS 8.5 and on)"},
      {"STOP_SIGNAL", krl::signal_of(c, 7)},
      {"FIXED", six ? "IsRuntime=\"false\" " : ""},
      {"FENCE_ARGUMENT", six ? " " : "CONTID"},
      {"FENCE_PARAMETER", six ? " " : "CONTID :IN "},
      {"FENCE_NUMBER", six ? "" : "  DECL INT CONTID"},
      {"SET_LIMIT", six ? "RSI_SetParameter(\"cellcal_rsi\"" : "RSI_SetPublicPar(CONTID"}};
  for (const auto& [name, text] : pairs) places[name] = text;
}

/// Parts that are of one correction, or of the fence, alone.
void add_parts(const RsiFilesConfig& c, const krl::Lists& lists, krl::Places& places) {
  constexpr std::pair<const char*, const char*> kFrames[] = {
      {"1", "Base"}, {"2", "RobRoot"}, {"3", "Tool"}};
  const auto& [number, name] = kFrames[static_cast<std::size_t>(c.space.frame)];
  places["FRAME_NUMBER"] = number;
  places["FRAME_NAME"] = name;
  places["SHIFT_LIMIT"] = decimal(c.space.limit_mm);
  places["TURN_LIMIT"] = decimal(c.space.turn_limit_deg);
  const std::string kind = c.space.on ? "space" : "axes";
  places["RSI3_CORRECTION"] = krl::part(kind + ".rsi.xml.in", places, lists);
  places["RSI4_CORRECTION"] = krl::part(kind + ".rsix.in", places, lists);
  places["MODEL_CORRECTION"] = krl::part(kind + ".rsi.in", places, lists);
  places["FENCE"] = c.space.on ? "" : krl::part("fence.src.in", places, lists);
}

krl::Places places_of(const RsiFilesConfig& c, const krl::Lists& lists) {
  const bool absolute = c.mode == CorrectionMode::kAbsolute;
  krl::Places places{
      {"VERSION", krl::release()},
      {"HOLD_ON", absolute ? "1" : "0"},
      {"LATE_REPLY", absolute ? "makes the arm hold" : "is a step that is lost, not one repeated"},
      {"PC_ADDRESS", c.pc_address},
      {"RSI_PORT", fmt::to_string(c.port)},
      {"SENTYPE", c.sentype},
      {"STOP_TAG", c.stop_tag},
      {"VALUE_TAG", c.space.on ? c.space.tag : c.axis_tag},
      {"RSI_TIMEOUT", fmt::to_string(c.timeout_cycles)},
      {"ALIVE_FLAG", fmt::to_string(c.flag)},
      // The editor draws one unconnected port.
      {"FREE_CHANNEL", fmt::to_string(lists.at("STATE").size() + 1)},
      {"TOOL_VALUE", krl::frame_value("TOOL_DATA", c.tool)},
      {"BASE_VALUE", krl::frame_value("BASE_DATA", c.base)},
      {"LOAD_VALUE", krl::load_value(c.load)},
  };
  add_release(c, places);
  add_parts(c, lists, places);
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
  krl::check_range("input", input, 1, 8192);
  if (space.on) {
    check_name("cart_tag", space.tag);
    krl::check_range("correction_limit_mm", space.limit_mm, 1.0, 5000.0);
    krl::check_range("correction_turn_limit_deg", space.turn_limit_deg, 0.1, 180.0);
    if (mode == CorrectionMode::kRelative) {
      throw ConfigError(
          "controller files: correction = \"space\" is not possible with mode RELATIVE. Use "
          "mode = \"absolute\"");
    }
  }
  krl::check_range("external_axes", external_axes, static_cast<double>(external.size()), 6);
  for (std::size_t i = 0; i < external.size(); ++i)
    krl::check_range(fmt::format("E{}'s range", i + 1).c_str(), travel_limit(external[i]), 1.0,
                     200'000.0);
  if (!external.empty() && space.on)
    throw ConfigError(
        "controller files: correction = \"space\" drives six axes, and neither a linear unit nor a "
        "positioner. Use correction = \"axes\"");
  krl::check_range("port", port, 1, 65535);
  krl::check_range("timeout_cycles", timeout_cycles, 1, 1000);
  krl::check_range("flag", flag, 1, 999);
  krl::check_range("correction_limit_deg", correction_limit_deg, 0.1, 360.0);
  if (!ranges_deg.empty() && ranges_deg.size() < static_cast<std::size_t>(kRsiAxes)) {
    throw ConfigError(
        fmt::format("controller files: ranges of {} axes, RSI corrects six", ranges_deg.size()));
  }
  krl::check_range("tool", tool, 0, 128);
  krl::check_range("base", base, 0, 128);
  krl::check_range("load", load, 0, 128);
}

ControllerFiles rsi_files(const RsiFilesConfig& config) {
  config.validate();
  const krl::Lists lists = lists_of(config);
  const krl::Places places = places_of(config, lists);
  ControllerFiles files;
  std::vector<std::string> names{"cellcal_rsi.src", "cellcal_rsi_ethernet.xml"};
  if (config.rsi_version == 3) {
    names.insert(names.end(), {"cellcal_rsi.rsi", "cellcal_rsi.rsi.xml"});
    files["cellcal_rsi.rsi.diagram"] = krl::fill(krl::rsi3_diagram(config), {});
  } else {
    names.emplace_back("cellcal_rsi.rsix");
  }
  for (const std::string& name : names) {
    files[name] = krl::fill(krl::template_text(name + ".in"), places, lists);
  }
  return files;
}

}  // namespace cellcal::drivers
