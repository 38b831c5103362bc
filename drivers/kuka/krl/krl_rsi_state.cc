#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "drivers/kuka/krl/krl_rsi_parts.h"

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
    set.findings.refuse(
        file.name, input == nullptr ? ethernet->line : input->line,
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
                      source.word ? fmt::format(" ({})", source.word) : "", source.tag,
                      source.says);
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
      {c.mode_tag, "mode_tag", "LONG", "STATUS", "Status", 62, "Stat", "the operating mode", "Int",
       "Type", kModeOp, "Mode_Op"},
      {c.override_tag, "override_tag", "DOUBLE", "OV_PRO", "OV_PRO", 63, "Out1", "the override"},
      {c.contact_tag, "contact_tag", "BOOL", "DIGIN", "DigIn", 29, "Out1", "the contact input",
       "Bool", "Index", c.input}};
  std::erase_if(all, [](const RsiStateSource& one) { return one.tag.empty(); });
  return all;
}

std::string object_id(const RsiStateSource& source, int rsi_version) {
  return rsi_version == 3 ? fmt::format("{}1", source.rsi3) : fmt::format("{}_1", source.rsi4);
}

std::string signal_of(const RsiFilesConfig& config, const std::string& object,
                      const std::string& output) {
  return config.rsi_version == 6 ? fmt::format(" SignalName=\"{}|{}\"", object, output) : "";
}

std::string signal_of(const RsiFilesConfig& config, int channel) {
  return signal_of(config, "Ethernet_1", fmt::format("Out{}", channel));
}

std::vector<Places> state_places(const RsiFilesConfig& config) {
  std::vector<Places> all;
  for (const RsiStateSource& one : state_sources(config)) {
    const std::string id4 = object_id(one, 4);
    all.push_back({{"TAG", one.tag},
                   {"TYPE", one.type},
                   {"INDEX", fmt::to_string(all.size())},
                   {"CHANNEL", fmt::to_string(all.size() + 1)},
                   {"ID3", object_id(one, 3)},
                   {"ID4", id4},
                   {"TYPE3", one.rsi3},
                   {"TYPE4", one.rsi4},
                   {"TYPE_ID", fmt::to_string(one.type_id)},
                   {"OUTPUT", one.output},
                   {"SIGNAL", signal_of(config, id4, one.output)},
                   {"SIGNAL_TYPE", one.signal},
                   {"PARAMETERS3", parameters(one, "  ", "ParamID", 1, "RSIObject")},
                   {"PARAMETERS4", parameters(one, "    ", "ParamId", 0, "RsiObject")},
                   {"MODEL_PARAMETERS", model_parameters(one)}});
  }
  return all;
}

void check_state(const RsiSet& set, const RsiContextFile* context) {
  for (const RsiStateSource& source : state_sources(set.config)) {
    const RsiElement* sent = set.sent(source.tag);
    if (sent == nullptr) {
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
