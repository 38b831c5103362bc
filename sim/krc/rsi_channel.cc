#include "sim/krc/rsi_channel.h"

#include <pugixml.hpp>
#include <stdexcept>

#include "drivers/kuka/wire/xml_values.h"

namespace cellcal::sim {
namespace {

namespace wire = drivers::wire;

constexpr std::size_t kMostReply = 8192, kMostPacket = 16384;
constexpr int kTechParameters = 10;

[[noreturn]] void refuse_context(const std::string& why) {
  throw std::invalid_argument("RSI ethernet file: " + why);
}

std::string attribute_of(const pugi::xml_node& node, const char* name) {
  for (const pugi::xml_attribute& attribute : node.attributes()) {
    if (wire::same_name(attribute.name(), name)) return attribute.value();
  }
  return {};
}

std::string constant_of(std::string_view tag, std::string_view type) {
  if (type == "STRING") return "";
  if (wire::lower(tag).find("progstatus") != std::string::npos) return "3";
  if (type == "DOUBLE") return "0.0";
  if (type == "LONG" || type == "BOOL") return "0";
  refuse_context("element " + std::string(tag) + ": TYPE \"" + std::string(type) +
                 "\" is not BOOL, LONG, DOUBLE or STRING");
}

/// DEF_Tech.C1 represents C11 to C110.
void add_tech(const std::string& set, RsiSent& element, const std::string& value) {
  for (int i = 1; i <= kTechParameters; ++i)
    element.values.push_back({set + std::to_string(i), value});
}

RsiSent& element_of(const std::string& name, std::vector<RsiSent>& send) {
  for (RsiSent& sent : send) {
    if (sent.name == name && sent.source == RsiSource::kConstant) return sent;
  }
  return send.emplace_back(RsiSent{name, RsiSource::kConstant, {}});
}

RsiSentValue::Of source_of(const std::string& element) {
  if (wire::same_name(element, "Mode")) return RsiSentValue::Of::kMode;
  const auto holds = [name = wire::lower(element)](const char* part) {
    return name.find(part) != std::string::npos;
  };
  if (holds("contact")) return RsiSentValue::Of::kInput;
  return holds("ovpro") ? RsiSentValue::Of::kOverride : RsiSentValue::Of::kConstant;
}

void add_sent(const std::string& tag, const std::string& type, RsiChannelConfig& config) {
  constexpr std::string_view kInternal = "DEF_";
  const bool internal = tag.starts_with(kInternal);
  const std::string path = internal ? tag.substr(kInternal.size()) : tag;
  const std::size_t dot = path.find('.');
  const std::string name = path.substr(0, dot);
  if (internal && dot == std::string::npos) {
    constexpr std::pair<std::string_view, RsiSource> kKnown[] = {
        {"RIst", RsiSource::kActualFrame},     {"RSol", RsiSource::kSetpointFrame},
        {"AIPos", RsiSource::kActualAxes},     {"ASPos", RsiSource::kSetpointAxes},
        {"EIPos", RsiSource::kActualExternal}, {"ESPos", RsiSource::kSetpointExternal},
        {"Delay", RsiSource::kDelay},
    };
    for (const auto& [known, source] : kKnown) {
      if (known == name) {
        config.send.push_back({name, source, {}});
        return;
      }
    }
    const bool currents = name == "MACur" || name == "MECur";
    if (currents) {
      RsiSent element{name, RsiSource::kConstant, {}};
      for (int i = 1; i <= 6; ++i)
        element.values.push_back({(name == "MACur" ? "A" : "E") + std::to_string(i), "0.0"});
      config.send.push_back(element);
      return;
    }
  }
  const std::string value = constant_of(tag, type);
  if (internal && name == "Tech" && dot != std::string::npos) {
    add_tech(path.substr(dot + 1), element_of(name, config.send), value);
  } else {
    add_sent_value(path, value, source_of(name), config.send);
  }
}

void add_received(const std::string& tag, const std::string& type, bool hold_on,
                  RsiChannelConfig& config) {
  const std::size_t dot = tag.find('.');
  RsiReceived value;
  value.element = tag.substr(0, dot);
  value.hold_on = hold_on;
  value.number = type != "STRING";
  if (dot == std::string::npos) {
    if (type == "BOOL" && wire::lower(tag).find("stop") != std::string::npos)
      value.role = RsiRole::kStop;
  } else {
    value.attribute = tag.substr(dot + 1);
    const std::string& name = value.attribute;
    const bool numbered = name.size() == 2 && name[1] >= '1' && name[1] <= '6';
    if (numbered && (name[0] == 'A' || name[0] == 'E') && type == "DOUBLE") {
      value.role = name[0] == 'A' ? RsiRole::kAxis : RsiRole::kExternal;
      value.index = static_cast<std::size_t>(name[1] - '1');
    } else if (name.size() == 1 && wire::kFrameNames.find(name[0]) != std::string_view::npos) {
      value.role = RsiRole::kCartesian;
      value.index = wire::kFrameNames.find(name[0]);
    }
  }
  // DEF_EStr and DEF_Tech have no effect here and are optional.
  if (!tag.starts_with("DEF_") && tag != "FREE") config.receive.push_back(value);
}

/// Six from `from` on: a controller always has them.
std::array<double, wire::kAxesPerElement> six(std::span<const double> deg, std::size_t from) {
  std::array<double, wire::kAxesPerElement> axes{};
  for (std::size_t i = 0; i < axes.size() && from + i < deg.size(); ++i) axes[i] = deg[from + i];
  return axes;
}

std::string override_text(double percent, int decimals) {
  std::array<char, 64> buffer{};
  return std::string(wire::Writer(buffer).put(percent, decimals).text());
}

std::string text_of(const RsiSentValue& value, const RsiValues& values, int decimals) {
  switch (value.of) {
    case RsiSentValue::Of::kMode: return std::to_string(values.mode);
    case RsiSentValue::Of::kOverride: return override_text(values.override_percent, decimals);
    case RsiSentValue::Of::kInput: return values.input_on ? "1" : "0";
    case RsiSentValue::Of::kConstant: break;
  }
  return value.constant;
}

void put_values(wire::Writer& out, const RsiSent& sent, const RsiValues& values, int decimals) {
  std::string text;
  bool has_text = false;
  out.put("<").put(sent.name);
  for (const RsiSentValue& one : sent.values) {
    const std::string value = text_of(one, values, decimals);
    if (one.name.empty()) {
      has_text = true;
      text = value;
    } else {
      out.put(" ").put(one.name).put("=\"").put(value).put("\"");
    }
  }
  if (has_text) {
    out.put(">").put(text).put("</").put(sent.name).put(">");
  } else {
    out.put("/>");
  }
}

}  // namespace

void add_sent_value(const std::string& tag, const std::string& constant, RsiSentValue::Of of,
                    std::vector<RsiSent>& send) {
  const std::size_t dot = tag.find('.');
  if (dot == std::string::npos) {
    send.push_back({tag, RsiSource::kConstant, {{"", constant, of}}});
  } else {
    element_of(tag.substr(0, dot), send).values.push_back({tag.substr(dot + 1), constant, of});
  }
}

RsiChannelConfig RsiChannelConfig::parse(std::string_view xml) {
  pugi::xml_document document;
  const pugi::xml_parse_result result = document.load_buffer(xml.data(), xml.size());
  if (!result) refuse_context(std::string("no XML: ") + result.description());
  const pugi::xml_node root = document.child("ROOT");
  const pugi::xml_node config = root.child("CONFIG");
  if (!config) refuse_context("ROOT/CONFIG is missing");
  RsiChannelConfig channel;
  channel.port = static_cast<std::uint16_t>(config.child("PORT").text().as_uint());
  if (channel.port == 0) refuse_context("CONFIG/PORT is missing");
  channel.sentype = wire::trim(config.child_value("SENTYPE"));
  if (channel.sentype.empty()) refuse_context("CONFIG/SENTYPE is missing");
  channel.only_send = wire::lower(wire::trim(config.child_value("ONLYSEND"))) == "true";
  for (const auto& element : root.child("SEND").child("ELEMENTS").children("ELEMENT"))
    add_sent(attribute_of(element, "TAG"), attribute_of(element, "TYPE"), channel);
  for (const auto& element : root.child("RECEIVE").child("ELEMENTS").children("ELEMENT")) {
    add_received(attribute_of(element, "TAG"), attribute_of(element, "TYPE"),
                 attribute_of(element, "HOLDON") == "1", channel);
  }
  if (channel.send.empty()) refuse_context("SEND/ELEMENTS holds no ELEMENT");
  return channel;
}

std::string format_packet(const RsiChannelConfig& channel, const RsiValues& v, int decimals) {
  std::array<char, kMostPacket> buffer;
  wire::Writer out(buffer);
  out.put("<Rob Type=\"KUKA\">");
  for (const RsiSent& sent : channel.send) {
    switch (sent.source) {
      case RsiSource::kActualFrame: out.frame(sent.name, v.actual_frame, decimals); break;
      case RsiSource::kSetpointFrame: out.frame(sent.name, v.setpoint_frame, decimals); break;
      case RsiSource::kActualAxes:
        out.element(sent.name, 'A', six(v.actual_deg, 0), decimals);
        break;
      case RsiSource::kSetpointAxes:
        out.element(sent.name, 'A', six(v.setpoint_deg, 0), decimals);
        break;
      case RsiSource::kActualExternal:
        out.element(sent.name, 'E', six(v.actual_deg, 6), decimals);
        break;
      case RsiSource::kSetpointExternal:
        out.element(sent.name, 'E', six(v.setpoint_deg, 6), decimals);
        break;
      case RsiSource::kDelay:
        out.put("<").put(sent.name).put(" D=\"").put(v.delay).put("\"/>");
        break;
      case RsiSource::kConstant: put_values(out, sent, v, decimals); break;
    }
  }
  out.put("<IPOC>").put(v.ipoc).put("</IPOC></Rob>");
  return std::string(out.text());
}

std::string format_first_packet(std::uint64_t ipoc) {
  return "<Rob Type=\"KUKA\"><IPOC>" + std::to_string(ipoc) + "</IPOC></Rob>";
}

std::optional<RsiReply> parse_reply(const RsiChannelConfig& channel, std::string_view bytes) {
  if (bytes.empty() || bytes.size() > kMostReply) return std::nullopt;
  // Some senders terminate their text with a zero byte.
  while (!bytes.empty() && bytes.back() == '\0') bytes.remove_suffix(1);
  pugi::xml_document document;
  if (!document.load_buffer(bytes.data(), bytes.size(), pugi::parse_default, pugi::encoding_utf8))
    return std::nullopt;
  const pugi::xml_node root = document.document_element();
  if (root.name() != std::string_view("Sen") || !root.child("IPOC")) return std::nullopt;
  RsiReply reply;
  reply.type = root.attribute("Type").value();
  reply.ipoc = wire::trim(root.child("IPOC").child_value());
  reply.values.resize(channel.receive.size());
  for (std::size_t i = 0; i < channel.receive.size(); ++i) {
    const RsiReceived& wanted = channel.receive[i];
    if (!wanted.number) continue;
    const pugi::xml_node node = root.child(wanted.element.c_str());
    if (!node) continue;
    std::string_view text = node.child_value();
    if (!wanted.attribute.empty()) {
      const pugi::xml_attribute attribute = node.attribute(wanted.attribute.c_str());
      if (!attribute) continue;
      text = attribute.value();
    }
    double value = 0.0;
    const std::string word = wire::lower(wire::trim(text));
    if (word == "true" || word == "false") {
      value = word == "true" ? 1.0 : 0.0;
    } else if (!wire::parse_number(text, value)) {
      return std::nullopt;
    }
    reply.values[i] = value;
  }
  return reply;
}

}  // namespace cellcal::sim
