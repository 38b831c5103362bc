#include "drivers/kuka/krl/krl_rsi_travel.h"

#include <fmt/format.h>

#include <algorithm>

#include "drivers/kuka/wire/xml_values.h"

namespace cellcal::drivers::krl {
namespace {

// RSI 3 numbers the inputs and limits of AXISCORREXT behind those of AXISCORR, RSI 4 from 0.
constexpr int kRsi3Input = 7, kRsi3Lower = 7, kRsi3Upper = 19, kRsi4Lower = 0, kRsi4Upper = 6;
// Defaults of the objects for parameters absent from the context.
constexpr double kUsualClampMm = 5, kUsualMonitorMm = 6;
constexpr double kTravelRounding = 1e-9;

/// {0} and {1}: the lower limit and the upper one.
std::string travel_limits(const RsiFilesConfig& c, const char* form) {
  const double limit = c.travel_limit_mm();
  return fmt::format(fmt::runtime(form), decimal(-limit), decimal(limit));
}

std::string rsi3_object(const RsiFilesConfig& c) {
  return fmt::format(
      "\n  <RSIObject ObjType=\"AXISCORREXT\" ObjTypeID=\"33\" ObjID=\"AXISCORREXT1\">\n"
      "    <Inputs>\n      <Input InIdx=\"{}\" OutObjID=\"ETHERNET1\" OutIdx=\"{}\"/>\n"
      "    </Inputs>\n    <Parameters>\n{}\n    </Parameters>\n  </RSIObject>",
      kRsi3Input, kTravelChannel,
      travel_limits(c,
                    "      <Parameter IsPublic=\"true\" Name=\"LowerLimE1\" ParamID=\"7\" "
                    "ParamValue=\"{}\"/>\n"
                    "      <Parameter IsPublic=\"true\" Name=\"UpperLimE1\" ParamID=\"19\" "
                    "ParamValue=\"{}\"/>"));
}

std::string rsi4_object(const RsiFilesConfig& c) {
  return fmt::format(
      "\n    <RsiObject ObjTypeId=\"87\" ObjType=\"AxisCorrExt\" ObjId=\"AxisCorrExt_1\">\n"
      "      <Inputs>\n        <Input InIdx=\"0\" OutObjId=\"Ethernet_1\" OutIdx=\"{}\"{}/>\n"
      "      </Inputs>\n      <Parameters>\n{}\n      </Parameters>\n    </RsiObject>",
      kTravelChannel - 1,
      c.rsi_version == 6 ? fmt::format(" SignalName=\"Ethernet_1|Out{}\"", kTravelChannel) : "",
      travel_limits(c,
                    "        <Parameter IsPublic=\"true\" Name=\"LowerLimE1\" ParamId=\"0\" "
                    "ParamValue=\"{}\"/>\n"
                    "        <Parameter IsPublic=\"true\" Name=\"UpperLimE1\" ParamId=\"6\" "
                    "ParamValue=\"{}\"/>"));
}

std::string model_limit(const char* name, double value, int index) {
  return fmt::format(
      "        <rSIParameter name=\"{}\" value=\"{}\" paramType=\"System.Double\" "
      "minVal=\"-2147483648\" maxVal=\"2147483647\" isEnum=\"false\" isPublic=\"true\" "
      "index=\"{}\" />\n",
      name, decimal(value), index);
}

std::string model_object(const RsiFilesConfig& c) {
  return fmt::format(
      "\n    <rSIElement name=\"AXISCORREXT1\" objType=\"AXISCORREXT\" objTypeID=\"33\" "
      "maxInputs=\"0\" maxOutputs=\"0\" inputOffset=\"7\" outputOffset=\"8\">\n"
      "      <rSIInPorts>\n        <rSIInPort name=\"CorrE1\" mandatory=\"false\">\n"
      "          <source>\n            <rSIOutPortMoniker name=\"//ETHERNET1/Out{}\" />\n"
      "          </source>\n        </rSIInPort>\n      </rSIInPorts>\n      <rSIOutPorts>\n"
      "        <rSIOutPort name=\"Stat\" signalType=\"Int\" />\n"
      "        <rSIOutPort name=\"E1\" />\n      </rSIOutPorts>\n      <rSIParameters>\n{}{}"
      "      </rSIParameters>\n    </rSIElement>",
      kTravelChannel, model_limit("LowerLimE1", -c.travel_limit_mm(), kRsi3Lower),
      model_limit("UpperLimE1", c.travel_limit_mm(), kRsi3Upper));
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
    } else if (set.config.linear_unit) {
      set.findings.refuse(file.name, 0, "SEND: {} is missing. Add it with INDX=\"INTERNAL\"", tag);
    } else {
      set.findings.warn(file.name, 0,
                        "SEND: {} is missing: external axes ([controller] external_axes) that move "
                        "unasked would not be noticed. Make the files again",
                        tag);
    }
  }
}

void check_travel_received(const RsiSet& set) {
  const std::string tag = travel_tag(set.config);
  const RsiElement* one = set.received(tag);
  if (one == nullptr)
    return set.findings.refuse(set.channel.name, 0,
                               "RECEIVE: {} is missing ([rsi] external_axis_tag = \"{}\"): the "
                               "linear unit could not travel. Make the files again",
                               tag, set.config.external_axis_tag);
  if (one->index == 0 || !wire::same_name(one->type, "DOUBLE"))
    set.findings.refuse(set.channel.name, one->line,
                        "{} must have TYPE=\"DOUBLE\" and a channel number as its INDX", tag);
  check_hold(set, *one);
}

void check_stroke(const RsiSet& set, const RsiContextFile& file, const RsiObject& corrector) {
  const double limit = set.config.travel_limit_mm();
  const RsiObject* monitor = file.only("AXISCORRMON");
  const ParameterValue low = value_of(set, file, corrector, "LowerLimE1", -kUsualClampMm);
  const ParameterValue high = value_of(set, file, corrector, "UpperLimE1", kUsualClampMm);
  ParameterValue most{kUsualMonitorMm, 0};
  if (monitor != nullptr) most = value_of(set, file, *monitor, "MaxE1", kUsualMonitorMm);
  struct Limit {
    const char* name;
    double reach;
    int line;
    const char* otherwise;
  };
  for (const Limit& one : {Limit{"LowerLimE1", -low.value, low.line, "be silently clamped"},
                           Limit{"UpperLimE1", high.value, high.line, "be silently clamped"},
                           Limit{"MaxE1", most.value, most.line, "stop with KSS29000"}}) {
    if (one.reach >= limit - kTravelRounding) continue;
    set.findings.refuse(file.name, one.line,
                        "{} allows {} mm from the start, the linear unit travels {}: it would {}. "
                        "Make the files again with the cell file (--cell)",
                        one.name, one.reach, limit, one.otherwise);
  }
}

void check_object(const RsiSet& set, const RsiContextFile& file) {
  const RsiObject* corrector = file.only("AXISCORREXT");
  const bool wanted = set.config.linear_unit.has_value();
  if (corrector == nullptr) {
    if (wanted)
      set.findings.refuse(file.name, 0,
                          "the AXISCORREXT object is missing: the linear unit could not travel. "
                          "Make the files again with the cell file (--cell)");
    return;
  }
  if (!wanted)
    return set.findings.refuse(file.name, corrector->line,
                               "{} corrects external axes, and no linear unit is known. Give the "
                               "cell file (--cell), or remove it",
                               corrector->id);
  const RsiObject* ethernet = file.only("ETHERNET");
  if (ethernet == nullptr) return;  // reported already
  check_wire(set, file, *corrector, file.rsi_version == 3 ? kRsi3Input : 1, ethernet->id,
             travel_tag(set.config));
  check_stroke(set, file, *corrector);
}

}  // namespace

const char* travel_corrector(const RsiFilesConfig& config) {
  return config.rsi_version == 3 ? "AXISCORREXT1" : "AxisCorrExt_1";
}

std::string travel_tag(const RsiFilesConfig& config) { return config.external_axis_tag + ".E1"; }

void add_travel(const RsiFilesConfig& c, Places& places) {
  places["EXTERNAL_ELEMENTS"] =
      c.external_axes == 0
          ? ""
          : "\n      <ELEMENT TAG=\"DEF_EIPos\" TYPE=\"DOUBLE\" INDX=\"INTERNAL\"/>"
            "\n      <ELEMENT TAG=\"DEF_ESPos\" TYPE=\"DOUBLE\" INDX=\"INTERNAL\"/>";
  places["TRAVEL_ELEMENT"] = "";
  if (!c.linear_unit) return;
  places["TRAVEL_ELEMENT"] =
      fmt::format("\n      <ELEMENT TAG=\"{}\" TYPE=\"DOUBLE\" INDX=\"{}\" HOLDON=\"{}\"/>",
                  travel_tag(c), kTravelChannel, places.find("HOLD_ON")->second);
  places["MODEL_CHANNELS"] +=
      fmt::format("\n        <rSIOutPort name=\"Out{}\" />", kTravelChannel);
  places["RSI3_CORRECTION"] += rsi3_object(c);
  places["RSI4_CORRECTION"] += rsi4_object(c);
  places["MODEL_CORRECTION"] += model_object(c);
}

void check_travel(const RsiSet& set, const RsiContextFile* context) {
  check_external_sent(set);
  if (set.config.linear_unit) check_travel_received(set);
  if (context != nullptr) check_object(set, *context);
}

}  // namespace cellcal::drivers::krl
