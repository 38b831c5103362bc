#include "drivers/kuka/krl/krl_rsi_state.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace cellcal::drivers::krl {
namespace {

/// Mode_Op in the list of STATUS, counted from 0 as published contexts have ProState_R = 2.
constexpr int kModeOp = 5;

const RsiObject* by_id(const RsiContextFile& file, const std::string& id) {
  const auto found = std::find_if(file.objects.begin(), file.objects.end(),
                                  [&](const RsiObject& one) { return one.id == id; });
  return found == file.objects.end() ? nullptr : &*found;
}

/// Another object, or another type of STATUS, would be taken for a mode: 2 of ProState_R is no T2.
void check_source(const RsiSet& set, const RsiContextFile& file, const RsiStateSource& source,
                  const RsiElement& sent) {
  const RsiObject* ethernet = file.only("ETHERNET");
  if (ethernet == nullptr) return;  // said already
  const RsiInput* input = ethernet->input(sent.index);
  const RsiObject* from = input == nullptr ? nullptr : by_id(file, input->from);
  if (from == nullptr || !wire::same_name(from->type, source.rsi3) || input->from_index != 1) {
    set.findings.refuse(file.name, input == nullptr ? ethernet->line : input->line,
                        "{}: input {} is {} (INDX in line {}), so it must come from the output of a "
                        "{} object",
                        ethernet->id, sent.index, source.tag, sent.line,
                        file.rsi_version == 3 ? source.rsi3 : source.rsi4);
    return;
  }
  if (source.of_type == 0) return;
  const RsiParameter* named = from->parameter("Type");
  if (named != nullptr && named->value == "Mode_Op") return;
  const ParameterValue type = value_of(set, file, *from, "Type", 0);
  if (type.value == source.of_type) return;
  set.findings.refuse(file.name, type.line, "Type of {} is {}. Set {} (Mode_Op): {} is {}",
                      from->id, type.value, source.of_type, source.tag, source.says);
}

}  // namespace

std::vector<RsiStateSource> state_sources(const RsiFilesConfig& c) {
  std::vector<RsiStateSource> all{
      {c.mode_tag, "mode_tag", "LONG", "STATUS", "Status", 62, "Stat", "the operating mode",
       kModeOp},
      {c.override_tag, "override_tag", "DOUBLE", "OV_PRO", "OV_PRO", 63, "Out1", "the override"}};
  std::erase_if(all, [](const RsiStateSource& one) { return one.tag.empty(); });
  return all;
}

std::string object_id(const RsiStateSource& source, int rsi_version) {
  return rsi_version == 3 ? fmt::format("{}1", source.rsi3) : fmt::format("{}_1", source.rsi4);
}

void add_state(const RsiFilesConfig& config, Places& places) {
  std::string elements, inputs3, inputs4, objects3, objects4, ports, model;
  int channel = 0;
  for (const RsiStateSource& one : state_sources(config)) {
    ++channel;
    const std::string id3 = object_id(one, 3), id4 = object_id(one, 4);
    elements += fmt::format("\n      <ELEMENT TAG=\"{}\" TYPE=\"{}\" INDX=\"{}\"/>", one.tag,
                            one.type, channel);
    inputs3 += fmt::format("\n      <Input InIdx=\"{}\" OutObjID=\"{}\" OutIdx=\"1\"/>", channel, id3);
    inputs4 += fmt::format(
        "\n        <Input InIdx=\"{}\" OutObjId=\"{}\" OutIdx=\"0\"{}/>", channel - 1, id4,
        config.rsi_version == 6 ? fmt::format(" SignalName=\"{}|{}\"", id4, one.output) : "");
    const bool typed = one.of_type != 0;
    objects3 += fmt::format("\n  <RSIObject ObjType=\"{}\" ObjTypeID=\"{}\" ObjID=\"{}\"", one.rsi3,
                            one.type_id, id3);
    objects3 += typed ? fmt::format(">\n    <Parameters>\n      <Parameter Name=\"Type\" "
                                    "ParamID=\"1\" ParamValue=\"{}\"/>\n    </Parameters>\n"
                                    "  </RSIObject>",
                                    one.of_type)
                      : "/>";
    objects4 += fmt::format("\n    <RsiObject ObjTypeId=\"{}\" ObjType=\"{}\" ObjId=\"{}\"",
                            one.type_id, one.rsi4, id4);
    objects4 += typed ? fmt::format(">\n      <Parameters>\n        <Parameter Name=\"Type\" "
                                    "ParamId=\"0\" ParamValue=\"{}\"/>\n      </Parameters>\n"
                                    "    </RsiObject>",
                                    one.of_type)
                      : "/>";
    ports += fmt::format(
        "        <rSIInPort name=\"In{}\" mandatory=\"false\">\n          <source>\n"
        "            <rSIOutPortMoniker name=\"//{}/{}\" />\n          </source>\n"
        "        </rSIInPort>\n",
        channel, id3, one.output);
    model += fmt::format(
        "\n    <rSIElement name=\"{}\" objType=\"{}\" objTypeID=\"{}\" maxInputs=\"0\" "
        "maxOutputs=\"0\">\n      <rSIOutPorts>\n        <rSIOutPort name=\"{}\" "
        "signalType=\"Int\" />\n      </rSIOutPorts>{}\n    </rSIElement>",
        id3, one.rsi3, one.type_id, one.output,
        typed ? "\n      <rSIParameters>\n        <rSIParameter name=\"Type\" value=\"Mode_Op\" "
                "paramType=\"KUKA.RSIVisual.RSI_StatusType\" minVal=\"-2147483648\" "
                "maxVal=\"2147483647\" isEnum=\"true\" index=\"1\" />\n      </rSIParameters>"
              : "");
  }
  const auto list = [](const std::string& inputs, const char* indent) {
    return inputs.empty() ? "" : fmt::format("\n{0}<Inputs>{1}\n{0}</Inputs>", indent, inputs);
  };
  places["STATE_ELEMENTS"] = elements;
  places["RSI3_STATE_INPUTS"] = list(inputs3, "    ");
  places["RSI4_STATE_INPUTS"] = list(inputs4, "      ");
  places["RSI3_STATE"] = objects3;
  places["RSI4_STATE"] = objects4;
  // The editor draws one port that is free.
  places["MODEL_STATE_PORTS"] =
      ports + fmt::format("        <rSIInPort name=\"In{}\" mandatory=\"false\" />", channel + 1);
  places["MODEL_STATE"] = model;
}

void check_state(const RsiSet& set, const RsiContextFile* context) {
  for (const RsiStateSource& source : state_sources(set.config)) {
    const auto sent =
        std::find_if(set.channel.send.begin(), set.channel.send.end(),
                     [&](const RsiElement& one) { return wire::same_name(one.tag, source.tag); });
    if (sent == set.channel.send.end()) {
      set.findings.warn(set.channel.name, 0,
                        "SEND: {} is missing: {} stays unknown. Install the set anew, or set [rsi] "
                        "{} = \"\"",
                        source.tag, source.says, source.key);
    } else if (sent->index == 0) {
      set.findings.refuse(set.channel.name, sent->line,
                          "SEND: INDX of {} is INTERNAL. Set the number of its channel", sent->tag);
    } else if (context != nullptr) {
      check_source(set, *context, source, *sent);
    }
  }
}

}  // namespace cellcal::drivers::krl
