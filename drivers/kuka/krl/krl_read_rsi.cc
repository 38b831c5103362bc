// Reader of RSI's files.

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "drivers/error.h"
#include "drivers/kuka/krl/krl_read.h"
#include "drivers/kuka/krl/krl_xml.h"
#include "drivers/kuka/wire/xml_values.h"

namespace cellcal::drivers {
namespace {

using krl::XmlText;

bool boolean(const XmlText& xml, const pugi::xml_node& node, const char* what,
             const std::string& text) {
  if (wire::same_name(text, "true") || text == "1") return true;
  if (wire::same_name(text, "false") || text == "0") return false;
  xml.fail(node, fmt::format("{} is neither TRUE nor FALSE", what));
}

void count(const XmlText& xml, const pugi::xml_node& node, std::size_t number) {
  if (number > kMostElements) xml.fail(node, "too many rsi_elements for such a file");
}

std::vector<RsiElement> rsi_elements(const XmlText& xml, const char* direction, bool receives) {
  std::vector<RsiElement> result;
  std::map<std::string, int> by_tag;  // lines
  std::map<int, std::size_t> by_index;
  const pugi::xml_node list = xml.only(xml.only(xml.root(), direction), "ELEMENTS");
  for (const pugi::xml_node& node : list.children("ELEMENT")) {
    RsiElement element;
    element.line = xml.line_of(node);
    element.tag = xml.attribute(node, "TAG");
    element.type = xml.attribute(node, "TYPE");
    const std::string index = xml.attribute(node, "INDX");
    const std::string what = fmt::format("INDX of {}", element.tag);
    element.index = wire::same_name(index, "INTERNAL")
                        ? 0
                        : xml.integer(node, what.c_str(), index, 1, kRsiChannels);
    if (node.attribute("HOLDON")) {
      element.hold_on = boolean(xml, node, "HOLDON", xml.attribute(node, "HOLDON"));
    } else if (receives && element.index > 0) {
      xml.fail(node, fmt::format("HOLDON of {} is missing", element.tag));
    }
    if (const auto [other, is_new] = by_tag.try_emplace(wire::lower(element.tag), element.line);
        !is_new)
      xml.fail(node, fmt::format("{} is already in line {}", element.tag, other->second));
    if (element.index > 0) {
      if (const auto [at, is_new] = by_index.try_emplace(element.index, result.size()); !is_new) {
        const RsiElement& other = result[at->second];
        xml.fail(node, fmt::format("INDX {} is already used by {} (line {})", element.index,
                                   other.tag, other.line));
      }
    }
    result.push_back(std::move(element));
    count(xml, node, result.size());
  }
  return result;
}

/// The root's name and spelling identify the release.
struct Spelling {
  int version;
  const char *object, *type, *id, *out_id;
  const char* list;  ///< between root and objects; nullptr: none
  int first;         ///< number of the first input or output
};
constexpr Spelling kRsi3{3, "RSIObject", "ObjType", "ObjID", "OutObjID", nullptr, 1};
constexpr Spelling kRsi4{4, "RsiObject", "ObjType", "ObjId", "OutObjId", "RsiObjects", 0};

RsiObject object(const XmlText& xml, const pugi::xml_node& node, const Spelling& s) {
  RsiObject result;
  result.line = xml.line_of(node);
  result.type = xml.attribute(node, s.type);
  result.id = xml.attribute(node, s.id);
  const auto number = [&](const pugi::xml_node& at, const char* key) {
    return xml.integer(at, key, xml.attribute(at, key), s.first, kRsiChannels) - s.first + 1;
  };
  for (const pugi::xml_node& input : node.child("Inputs").children("Input")) {
    result.inputs.push_back({number(input, "InIdx"), xml.attribute(input, s.out_id),
                             number(input, "OutIdx"), xml.line_of(input)});
    count(xml, input, result.inputs.size());
  }
  for (const pugi::xml_node& one : node.child("Parameters").children("Parameter")) {
    result.parameters.push_back({xml.attribute(one, "Name"), one.attribute("ParamValue").value(),
                                 xml.line_of(one), one.attribute("IsRuntime").as_bool(true),
                                 one.attribute("IsPublic").as_bool()});
    count(xml, one, result.parameters.size());
  }
  return result;
}

/// RSI 6 is RSI 4 except for its monitors: their limits are fixed once the context is loaded.
bool has_fixed_monitor(const RsiContextFile& file) {
  return std::any_of(file.objects.begin(), file.objects.end(), [](const RsiObject& one) {
    const RsiParameter* limit = one.parameter(one.type == "AxisCorrMon" ? "MaxA1" : "MaxTrans");
    return one.type.ends_with("CorrMon") && limit != nullptr && !limit->runtime;
  });
}

/// Parses "//ETHERNET1/Out7". Stat is the first output if there is one; other port names than that
/// or OutN have the number 0, since RSI-Visual allows renaming.
RsiInput from_moniker(const XmlText& xml, const pugi::xml_node& node, int index) {
  const std::string path = xml.attribute(node, "name");
  const std::size_t slash = path.rfind('/');
  const std::string_view port = std::string_view(path).substr(slash + 1);
  if (path.substr(0, 2) != "//" || slash == std::string::npos || slash < 3) {
    xml.fail(node, "is not \"//OBJECT/OutN\"");
  }
  const bool numbered = port.substr(0, 3) == "Out" && port.size() > 3 &&
                        port.find_first_not_of("0123456789", 3) == std::string_view::npos;
  if (port == "Stat") return {index, path.substr(2, slash - 2), 1, xml.line_of(node)};
  return {index, path.substr(2, slash - 2),
          numbered ? xml.integer(node, "OutN", std::string(port.substr(3)), 1, kRsiChannels) : 0,
          xml.line_of(node)};
}

}  // namespace

const RsiParameter* RsiObject::parameter(std::string_view parameter_name) const {
  for (const RsiParameter& one : parameters) {
    if (wire::same_name(one.name, parameter_name)) return &one;
  }
  return nullptr;
}

const RsiInput* RsiObject::input(int input_index) const {
  for (const RsiInput& one : inputs) {
    if (one.index == input_index) return &one;
  }
  return nullptr;
}

const RsiObject* RsiContextFile::only(std::string_view type) const {
  const RsiObject* found = nullptr;
  for (const RsiObject& one : objects) {
    if (!wire::same_name(one.type, type)) continue;
    if (found != nullptr) {
      throw ConfigError(fmt::format("{}:{}: a second {} ({}; the first is {})", name, one.line,
                                    one.type, one.id, found->id));
    }
    found = &one;
  }
  return found;
}

RsiChannelFile read_rsi_channel(std::string_view text, const std::string& name) {
  const XmlText xml(text, name);
  if (std::string_view(xml.root().name()) != "ROOT") {
    xml.fail(xml.root(), "is not ROOT: not an ethernet XML of RSI");
  }
  const pugi::xml_node config = xml.only(xml.root(), "CONFIG");
  const auto line = [&](const char* child) { return xml.line_of(config.child(child)); };
  RsiChannelFile file;
  file.name = name;
  file.ip_number = {xml.text_of(config, "IP_NUMBER"), line("IP_NUMBER")};
  file.sentype = {xml.text_of(config, "SENTYPE"), line("SENTYPE")};
  file.port = {xml.integer(config.child("PORT"), "PORT", xml.text_of(config, "PORT"), 1, 65535),
               line("PORT")};
  file.only_send = {
      boolean(xml, xml.only(config, "ONLYSEND"), "ONLYSEND", xml.text_of(config, "ONLYSEND")),
      line("ONLYSEND")};
  file.send = rsi_elements(xml, "SEND", false);
  file.receive = rsi_elements(xml, "RECEIVE", true);
  return file;
}

RsiContextFile read_rsi_context(std::string_view text, const std::string& name) {
  const XmlText xml(text, name);
  const std::string_view root = xml.root().name();
  if (root != "RSIObjects" && root != "RsiContext") {
    xml.fail(xml.root(),
             "is neither RSIObjects (RSI 3) nor RsiContext (RSI 4 to 6): not a context");
  }
  const Spelling& s = root == "RSIObjects" ? kRsi3 : kRsi4;
  const pugi::xml_node list = s.list == nullptr ? xml.root() : xml.only(xml.root(), s.list);
  RsiContextFile file;
  file.name = name;
  file.rsi_version = s.version;
  for (const pugi::xml_node& node : list.children(s.object)) {
    file.objects.push_back(object(xml, node, s));
    count(xml, node, file.objects.size());
  }
  if (file.objects.empty()) xml.fail(list, fmt::format("holds no <{}>", s.object));
  if (s.version == 4 && has_fixed_monitor(file)) file.rsi_version = 6;
  return file;
}

RsiContextFile read_rsi_model(std::string_view text, const std::string& name) {
  const XmlText xml(text, name);
  if (std::string_view(xml.root().name()) != "rSIModel") {
    xml.fail(xml.root(), "is not rSIModel: not a model of RSI-Visual");
  }
  RsiContextFile file;
  file.name = name;
  file.rsi_version = 3;
  for (const pugi::xml_node& node : xml.only(xml.root(), "rSIObjects").children("rSIElement")) {
    RsiObject one;
    one.line = xml.line_of(node);
    one.type = xml.attribute(node, "objType");
    one.id = xml.attribute(node, "name");
    // Inputs of AXISCORREXT, numbered after those of AXISCORR.
    int index = node.attribute("inputOffset")
                    ? xml.integer(node, "inputOffset", node.attribute("inputOffset").value(), 1,
                                  kRsiChannels) -
                          1
                    : 0;
    for (const pugi::xml_node& port : node.child("rSIInPorts").children("rSIInPort")) {
      ++index;
      const pugi::xml_node from = port.child("source").child("rSIOutPortMoniker");
      if (from) one.inputs.push_back(from_moniker(xml, from, index));
      count(xml, port, static_cast<std::size_t>(index));
    }
    for (const pugi::xml_node& parameter : node.child("rSIParameters").children("rSIParameter")) {
      one.parameters.push_back({xml.attribute(parameter, "name"),
                                parameter.attribute("value").value(), xml.line_of(parameter)});
      count(xml, parameter, one.parameters.size());
    }
    file.objects.push_back(std::move(one));
    count(xml, node, file.objects.size());
  }
  return file;
}

}  // namespace cellcal::drivers
