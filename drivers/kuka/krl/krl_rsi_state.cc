#include "drivers/kuka/krl/krl_rsi_parts.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace cellcal::drivers::krl {
namespace {

/// Index of Mode_Op in the list of STATUS, from 0 as in published contexts with ProState_R = 2.
constexpr int kModeOp = 5;

const RsiObject* by_id(const RsiContextFile& file, const std::string& id) {
  const auto found = std::find_if(file.objects.begin(), file.objects.end(),
                                  [&](const RsiObject& one) { return one.id == id; });
  return found == file.objects.end() ? nullptr : &*found;
}

/// Another object, or another type of STATUS, would be misread as a mode: 2 of ProState_R is not
/// T2.
void check_source(const RsiSet& set, const RsiContextFile& file, const RsiStateSource& source,
                  const RsiElement& sent) {
  const RsiObject* ethernet = file.only("ETHERNET");
  if (ethernet == nullptr) return;  // reported already
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
  if (source.parameter == nullptr) return;
  for (const char* size : {"DataSize", "DataType"}) {  // by its name in either release
    const RsiParameter* wide = from->parameter(size);
    if (wide != nullptr && wide->value != "0" && wide->value != "Bit")
      set.findings.refuse(file.name, wide->line, "{} of {} is {}. Set 0 (Bit)", size, from->id,
                          wide->value);
  }
  const RsiParameter* named = from->parameter(source.parameter);
  if (named != nullptr && source.word != nullptr && named->value == source.word) return;
  const ParameterValue have = value_of(set, file, *from, source.parameter, 0);
  if (have.value == source.value) return;
  set.findings.refuse(file.name, have.line, "{} of {} is {}. Set {}{}: {} is {}", source.parameter,
                      from->id, have.value, source.value,
                      source.word ? fmt::format(" ({})", source.word) : "", source.tag, source.says);
}

/// The object's parameter as a list, or the end tag of an object without one.
std::string parameters(const RsiStateSource& one, const char* indent, const char* id, int number,
                       const char* object) {
  if (one.parameter == nullptr) return "/>";
  return fmt::format(
      ">\n{0}  <Parameters>\n{0}    <Parameter Name=\"{1}\" {2}=\"{3}\" ParamValue=\"{4}\"/>\n"
      "{0}  </Parameters>\n{0}</{5}>",
      indent, one.parameter, id, number, one.value, object);
}

std::string model_parameters(const RsiStateSource& one) {
  if (one.parameter == nullptr) return "";
  const bool word = one.word != nullptr;
  return fmt::format(
      "\n      <rSIParameters>\n        <rSIParameter name=\"{}\" value=\"{}\" paramType=\"{}\" "
      "minVal=\"-2147483648\" maxVal=\"2147483647\" isEnum=\"{}\" index=\"1\" />\n"
      "      </rSIParameters>",
      one.parameter, word ? std::string(one.word) : fmt::to_string(one.value),
      word ? "KUKA.RSIVisual.RSI_StatusType" : "System.Int32", word);
}

}  // namespace

std::vector<RsiStateSource> state_sources(const RsiFilesConfig& c) {
  std::vector<RsiStateSource> all{
      {c.mode_tag, "mode_tag", "LONG", "STATUS", "Status", 62, "Stat", "the operating mode",
       "Int", "Type", kModeOp, "Mode_Op"},
      {c.override_tag, "override_tag", "DOUBLE", "OV_PRO", "OV_PRO", 63, "Out1", "the override"},
      {c.contact_tag, "contact_tag", "BOOL", "DIGIN", "DigIn", 29, "Out1", "the contact input",
       "Bool", "Index", c.input}};
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
    objects3 += fmt::format("\n  <RSIObject ObjType=\"{}\" ObjTypeID=\"{}\" ObjID=\"{}\"", one.rsi3,
                            one.type_id, id3);
    objects3 += parameters(one, "  ", "ParamID", 1, "RSIObject");
    objects4 += fmt::format("\n    <RsiObject ObjTypeId=\"{}\" ObjType=\"{}\" ObjId=\"{}\"",
                            one.type_id, one.rsi4, id4);
    objects4 += parameters(one, "    ", "ParamId", 0, "RsiObject");
    ports += fmt::format(
        "        <rSIInPort name=\"In{}\" mandatory=\"false\">\n          <source>\n"
        "            <rSIOutPortMoniker name=\"//{}/{}\" />\n          </source>\n"
        "        </rSIInPort>\n",
        channel, id3, one.output);
    model += fmt::format(
        "\n    <rSIElement name=\"{}\" objType=\"{}\" objTypeID=\"{}\" maxInputs=\"0\" "
        "maxOutputs=\"0\">\n      <rSIOutPorts>\n        <rSIOutPort name=\"{}\" "
        "signalType=\"{}\" />\n      </rSIOutPorts>{}\n    </rSIElement>",
        id3, one.rsi3, one.type_id, one.output, one.signal, model_parameters(one));
  }
  const auto list = [](const std::string& inputs, const char* indent) {
    return inputs.empty() ? "" : fmt::format("\n{0}<Inputs>{1}\n{0}</Inputs>", indent, inputs);
  };
  places["STATE_ELEMENTS"] = elements;
  places["RSI3_STATE_INPUTS"] = list(inputs3, "    ");
  places["RSI4_STATE_INPUTS"] = list(inputs4, "      ");
  places["RSI3_STATE"] = objects3;
  places["RSI4_STATE"] = objects4;
  // The editor draws one unconnected port.
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
