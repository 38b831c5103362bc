#include "drivers/kuka/krl/krl_rsi_parts.h"

#include <fmt/format.h>

#include <algorithm>

#include "drivers/kuka/wire/xml_values.h"

namespace cellcal::drivers::krl {
namespace {

// RSI 3 numbers the inputs and limits of AXISCORREXT after those of AXISCORR, RSI 4 from 0.
constexpr int kRsi3Input = 7, kRsi3Lower = 7, kRsi3Upper = 19, kRsi4Lower = 0, kRsi4Upper = 6;
// Defaults of the objects for parameters absent from the context.
constexpr double kUsualClamp = 5, kUsualMonitor = 6;
constexpr double kTravelRounding = 1e-9;
constexpr int kMostExternal = 6;

/// Lines by `line` for each corrected axis, from 0.
template <class Line>
std::string each(const RsiFilesConfig& c, Line line) {
  std::string text;
  for (int i = 0; i < static_cast<int>(c.external.size()); ++i) text += line(i);
  return text;
}

/// Lines of the lower limits, then of the upper ones. {0}: name, {1}: number of the parameter, {2}: value.
std::string travel_limits(const RsiFilesConfig& c, const char* form, int lower, int upper) {
  const auto lines = [&](const char* name, int first, double sign) {
    return each(c, [&](int i) {
      const AxisRange& range = c.external[static_cast<std::size_t>(i)];
      return fmt::format(fmt::runtime(form), fmt::format("{}LimE{}", name, i + 1), first + i,
                         decimal(sign * travel_limit(range)));
    });
  };
  return lines("Lower", lower, -1.0) + lines("Upper", upper, 1.0);
}

std::string rsi3_object(const RsiFilesConfig& c) {
  return fmt::format(
      "\n  <RSIObject ObjType=\"AXISCORREXT\" ObjTypeID=\"33\" ObjID=\"AXISCORREXT1\">\n"
      "    <Inputs>\n{}    </Inputs>\n    <Parameters>\n{}    </Parameters>\n  </RSIObject>",
      each(c,
           [](int i) {
             return fmt::format(
                 "      <Input InIdx=\"{}\" OutObjID=\"ETHERNET1\" OutIdx=\"{}\"/>\n",
                 kRsi3Input + i, kTravelChannel + i);
           }),
      travel_limits(c,
                    "      <Parameter IsPublic=\"true\" Name=\"{}\" ParamID=\"{}\" "
                    "ParamValue=\"{}\"/>\n",
                    kRsi3Lower, kRsi3Upper));
}

std::string rsi4_object(const RsiFilesConfig& c) {
  const auto signal = [&](int channel) {
    return c.rsi_version == 6 ? fmt::format(" SignalName=\"Ethernet_1|Out{}\"", channel) : "";
  };
  return fmt::format(
      "\n    <RsiObject ObjTypeId=\"87\" ObjType=\"AxisCorrExt\" ObjId=\"AxisCorrExt_1\">\n"
      "      <Inputs>\n{}      </Inputs>\n      <Parameters>\n{}      </Parameters>\n"
      "    </RsiObject>",
      each(c,
           [&](int i) {
             return fmt::format(
                 "        <Input InIdx=\"{}\" OutObjId=\"Ethernet_1\" OutIdx=\"{}\"{}/>\n", i,
                 kTravelChannel - 1 + i, signal(kTravelChannel + i));
           }),
      travel_limits(c,
                    "        <Parameter IsPublic=\"true\" Name=\"{}\" ParamId=\"{}\" "
                    "ParamValue=\"{}\"/>\n",
                    kRsi4Lower, kRsi4Upper));
}

std::string model_object(const RsiFilesConfig& c) {
  return fmt::format(
      "\n    <rSIElement name=\"AXISCORREXT1\" objType=\"AXISCORREXT\" objTypeID=\"33\" "
      "maxInputs=\"0\" maxOutputs=\"0\" inputOffset=\"7\" outputOffset=\"8\">\n"
      "      <rSIInPorts>\n{}      </rSIInPorts>\n      <rSIOutPorts>\n"
      "        <rSIOutPort name=\"Stat\" signalType=\"Int\" />\n{}"
      "      </rSIOutPorts>\n      <rSIParameters>\n{}"
      "      </rSIParameters>\n    </rSIElement>",
      each(c,
           [](int i) {
             return fmt::format(
                 "        <rSIInPort name=\"CorrE{}\" mandatory=\"false\">\n"
                 "          <source>\n            <rSIOutPortMoniker name=\"//ETHERNET1/Out{}\" "
                 "/>\n          </source>\n        </rSIInPort>\n",
                 i + 1, kTravelChannel + i);
           }),
      each(c, [](int i) { return fmt::format("        <rSIOutPort name=\"E{}\" />\n", i + 1); }),
      travel_limits(c,
                    "        <rSIParameter name=\"{0}\" value=\"{2}\" "
                    "paramType=\"System.Double\" minVal=\"-2147483648\" maxVal=\"2147483647\" "
                    "isEnum=\"false\" isPublic=\"true\" index=\"{1}\" />\n",
                    kRsi3Lower, kRsi3Upper));
}

/// Name of a corrected axis in messages.
std::string driven(const AxisRange& range, std::size_t axis) {
  return range.linear ? "the linear unit" : fmt::format("E{} of the positioner", axis + 1);
}

void check_external_sent(const RsiSet& set) {
  if (set.config.external_axes == 0) return;
  const RsiChannelFile& file = set.channel;
  for (const char* tag : {"DEF_EIPos", "DEF_ESPos"}) {
    const auto sent = std::find_if(file.send.begin(), file.send.end(), [&](const RsiElement& one) {
      return wire::same_name(one.tag, tag);
    });
    if (sent != file.send.end()) {
      if (sent->index != 0)
        set.findings.refuse(file.name, sent->line, "SEND: INDX of {} is {}. Set \"INTERNAL\"", tag,
                            sent->index);
    } else if (!set.config.external.empty()) {
      set.findings.refuse(file.name, 0, "SEND: {} is missing. Add it with INDX=\"INTERNAL\"", tag);
    } else {
      set.findings.warn(file.name, 0,
                        "SEND: {} is missing: external axes ([controller] external_axes) that move "
                        "unasked would not be noticed. Make the files again",
                        tag);
    }
  }
}

void check_travel_received(const RsiSet& set, std::size_t axis) {
  const std::string tag = travel_tag(set.config, axis);
  const RsiElement* one = set.received(tag);
  if (one == nullptr)
    return set.findings.refuse(set.channel.name, 0,
                               "RECEIVE: {} is missing ([rsi] external_axis_tag = \"{}\"): {} "
                               "could not move. Make the files again",
                               tag, set.config.external_axis_tag,
                               driven(set.config.external[axis], axis));
  if (one->index == 0 || !wire::same_name(one->type, "DOUBLE"))
    set.findings.refuse(set.channel.name, one->line,
                        "{} must have TYPE=\"DOUBLE\" and a channel number as its INDX", tag);
  check_hold(set, *one);
}

void check_reach(const RsiSet& set, const RsiContextFile& file, const RsiObject& corrector,
                 std::size_t axis) {
  const AxisRange& range = set.config.external[axis];
  const double limit = travel_limit(range);
  const RsiObject* monitor = file.only("AXISCORRMON");
  const std::string lower = fmt::format("LowerLimE{}", axis + 1),
                    upper = fmt::format("UpperLimE{}", axis + 1),
                    total = fmt::format("MaxE{}", axis + 1);
  const ParameterValue low = value_of(set, file, corrector, lower, -kUsualClamp);
  const ParameterValue high = value_of(set, file, corrector, upper, kUsualClamp);
  ParameterValue most{kUsualMonitor, 0};
  if (monitor != nullptr) most = value_of(set, file, *monitor, total, kUsualMonitor);
  struct Limit {
    const std::string& name;
    double reach;
    int line;
    const char* otherwise;
  };
  for (const Limit& one : {Limit{lower, -low.value, low.line, "be silently clamped"},
                           Limit{upper, high.value, high.line, "be silently clamped"},
                           Limit{total, most.value, most.line, "stop with KSS29000"}}) {
    if (one.reach >= limit - kTravelRounding) continue;
    set.findings.refuse(file.name, one.line,
                        "{} allows {} {} from the start, {} {} {}: it would {}. Make the files "
                        "again with the cell file (--cell)",
                        one.name, one.reach, range.linear ? "mm" : "deg", driven(range, axis),
                        range.linear ? "travels" : "turns by up to", limit, one.otherwise);
  }
}

void check_object(const RsiSet& set, const RsiContextFile& file) {
  const RsiObject* corrector = file.only("AXISCORREXT");
  const std::vector<AxisRange>& external = set.config.external;
  if (corrector == nullptr) {
    if (!external.empty())
      set.findings.refuse(file.name, 0,
                          "the AXISCORREXT object is missing: {} could not move. Make the files "
                          "again with the cell file (--cell)",
                          driven(external[0], 0));
    return;
  }
  if (external.empty())
    return set.findings.refuse(file.name, corrector->line,
                               "{} corrects external axes, and neither a linear unit nor a "
                               "positioner is known. Give the cell file (--cell), or remove it",
                               corrector->id);
  const int first = file.rsi_version == 3 ? kRsi3Input : 1;
  for (int input = first + static_cast<int>(external.size()); input < first + kMostExternal;
       ++input)
    if (corrector->input(input) != nullptr)
      set.findings.refuse(file.name, corrector->input(input)->line,
                          "{} corrects E{}, which the robot file does not move. Give the cell file "
                          "(--cell), or remove input {}",
                          corrector->id, input - first + 1, input);
  const RsiObject* ethernet = file.only("ETHERNET");
  if (ethernet == nullptr) return;  // reported already
  for (std::size_t i = 0; i < external.size(); ++i) {
    check_wire(set, file, *corrector, first + static_cast<int>(i), ethernet->id,
               travel_tag(set.config, i));
    check_reach(set, file, *corrector, i);
  }
}

}  // namespace

const char* travel_corrector(const RsiFilesConfig& config) {
  return config.rsi_version == 3 ? "AXISCORREXT1" : "AxisCorrExt_1";
}

std::string travel_tag(const RsiFilesConfig& config, std::size_t axis) {
  return fmt::format("{}.E{}", config.external_axis_tag, axis + 1);
}

void add_travel(const RsiFilesConfig& c, Places& places) {
  places["EXTERNAL_ELEMENTS"] =
      c.external_axes == 0
          ? ""
          : "\n      <ELEMENT TAG=\"DEF_EIPos\" TYPE=\"DOUBLE\" INDX=\"INTERNAL\"/>"
            "\n      <ELEMENT TAG=\"DEF_ESPos\" TYPE=\"DOUBLE\" INDX=\"INTERNAL\"/>";
  places["TRAVEL_ELEMENT"] = each(c, [&](int i) {
    return fmt::format("\n      <ELEMENT TAG=\"{}\" TYPE=\"DOUBLE\" INDX=\"{}\" HOLDON=\"{}\"/>",
                       travel_tag(c, static_cast<std::size_t>(i)), kTravelChannel + i,
                       places.find("HOLD_ON")->second);
  });
  if (c.external.empty()) return;
  places["MODEL_CHANNELS"] += each(c, [](int i) {
    return fmt::format("\n        <rSIOutPort name=\"Out{}\" />", kTravelChannel + i);
  });
  places["RSI3_CORRECTION"] += rsi3_object(c);
  places["RSI4_CORRECTION"] += rsi4_object(c);
  places["MODEL_CORRECTION"] += model_object(c);
}

void check_travel(const RsiSet& set, const RsiContextFile* context) {
  check_external_sent(set);
  for (std::size_t i = 0; i < set.config.external.size(); ++i) check_travel_received(set, i);
  if (context != nullptr) check_object(set, *context);
}

}  // namespace cellcal::drivers::krl
