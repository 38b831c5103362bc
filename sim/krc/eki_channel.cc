#include "sim/krc/eki_channel.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <pugixml.hpp>
#include <stdexcept>
#include <utility>

#include "drivers/kuka/wire/xml_values.h"

namespace cellcal::sim {

namespace {

namespace wire = drivers::wire;

constexpr std::size_t kMostMessages = 100;
constexpr unsigned kLargestLimit = 512, kLargestBytes = 65534;  // EKI 2.2

[[noreturn]] void refuse(const std::string& why) {
  throw std::invalid_argument("EKI channel file: " + why);
}

EkiElementType type_of(const std::string& tag, const std::string& type) {
  if (type == "REAL") return EkiElementType::kReal;
  if (type == "INT") return EkiElementType::kInt;
  if (type == "BOOL") return EkiElementType::kBool;
  if (type == "STRING") return EkiElementType::kString;
  refuse("element " + tag + ": Type \"" + type + "\" is not REAL, INT, BOOL, STRING or FRAME");
}

std::size_t limit_of(const pugi::xml_node& node, std::size_t usual, unsigned most) {
  if (!node) return usual;
  const unsigned value = node.attribute("Limit").as_uint();
  if (value < 1 || value > most) {
    refuse(std::string(node.name()) + "/@Limit is outside 1.." + std::to_string(most));
  }
  return value;
}

/// The node of a path without its attribute, below `root` whose own name is the first part.
pugi::xml_node find(pugi::xml_node node, std::string_view path) {
  std::size_t from = 0;
  for (bool first = true; from <= path.size(); first = false) {
    const std::size_t to = std::min(path.find('/', from), path.size());
    const std::string_view part = path.substr(from, to - from);
    from = to + 1;
    if (first) {
      if (!wire::same_name(node.name(), part)) return {};
      continue;
    }
    pugi::xml_node next;
    for (const pugi::xml_node& child : node.children()) {
      if (wire::same_name(child.name(), part)) next = child;
    }
    if (!next) return {};
    node = next;
  }
  return node;
}

std::optional<std::string> text_at(const pugi::xml_node& root, std::string_view path) {
  const std::size_t at = path.find("/@");
  const pugi::xml_node node = find(root, path.substr(0, at));
  if (!node) return std::nullopt;
  if (at == std::string_view::npos) return node.child_value();
  const std::string_view name = path.substr(at + 2);
  for (const pugi::xml_attribute& attribute : node.attributes()) {
    if (wire::same_name(attribute.name(), name)) return attribute.value();
  }
  for (const pugi::xml_node& child : node.children()) {
    if (wire::same_name(child.name(), name)) return child.child_value();
  }
  return std::nullopt;
}

bool is_whole(double value) { return value == std::floor(value) && std::abs(value) < 2147483648.0; }

}  // namespace

std::string eki_real(double value) {
  std::array<char, 64> buffer{};
  const auto end =
      std::to_chars(buffer.data(), buffer.data() + buffer.size(),
                    static_cast<double>(static_cast<float>(value)), std::chars_format::fixed, 6);
  return {buffer.data(), end.ptr};
}

EkiChannelConfig EkiChannelConfig::parse(std::string_view xml) {
  pugi::xml_document document;
  const pugi::xml_parse_result result = document.load_buffer(xml.data(), xml.size());
  if (!result) refuse(std::string("no XML: ") + result.description());
  const pugi::xml_node root = document.child("ETHERNETKRL");
  const pugi::xml_node internal = root.child("CONFIGURATION").child("INTERNAL");
  if (!internal) refuse("ETHERNETKRL/CONFIGURATION/INTERNAL is missing");
  if (root.select_node("CONFIGURATION/EXTERNAL/TYPE").node().child_value() !=
      std::string_view("Client")) {
    refuse("EXTERNAL/TYPE is not Client: here the controller is the server");
  }
  EkiChannelConfig config;
  const std::string_view protocol = wire::trim(internal.child_value("PROTOCOL"));
  config.udp = protocol == "UDP";
  if (!config.udp && !protocol.empty() && protocol != "TCP")
    refuse("PROTOCOL is neither TCP nor UDP");
  config.port = static_cast<std::uint16_t>(internal.child("PORT").text().as_uint());
  if (config.port == 0) refuse("INTERNAL/PORT is missing");
  config.limit = limit_of(internal.child("BUFFERING"), config.limit, kLargestLimit);
  config.bytes = limit_of(internal.child("BUFFSIZE"), config.bytes, kLargestBytes);
  config.survives_reset = internal.child_value("ENVIRONMENT") != std::string_view("Program");
  if (const auto flag = internal.child("ALIVE").attribute("Set_Flag")) {
    config.alive_flag = flag.as_int();
  }
  for (const pugi::xml_node& element : root.child("RECEIVE").child("XML").children("ELEMENT")) {
    const std::string tag = element.attribute("Tag").value();
    const pugi::xml_attribute type = element.attribute("Type");
    if (!type) continue;  // an event flag on a structure
    if (type.value() == std::string_view("FRAME")) {
      for (const char* name : {"/@X", "/@Y", "/@Z", "/@A", "/@B", "/@C"})
        config.receive.emplace_back(tag + name, EkiElementType::kReal);
      continue;
    }
    config.receive.emplace_back(tag, type_of(tag, type.value()));
  }
  for (const pugi::xml_node& element : root.child("SEND").child("XML").children("ELEMENT")) {
    config.send.emplace_back(element.attribute("Tag").value());
  }
  if (config.receive.empty() && config.send.empty()) refuse("RECEIVE and SEND hold no ELEMENT");
  return config;
}

EkiChannel::EkiChannel(EkiChannelConfig config) : config_(std::move(config)) {
  for (const auto& [path, type] : config_.receive) queues_[wire::lower(path)].type = type;
}

void EkiChannel::close() {
  open_ = false;
  drop_client();
}

void EkiChannel::empty_queues() {
  for (auto& [path, queue] : queues_) queue.values.clear();
}

void EkiChannel::clear() {
  empty_queues();
  close();
}

void EkiChannel::remove() {
  clear();
  exists_ = false;
}

std::size_t EkiChannel::waiting(std::string_view path) const {
  const auto found = queues_.find(wire::lower(path));
  return found == queues_.end() ? 0 : found->second.values.size();
}

std::optional<double> EkiChannel::get(std::string_view path) {
  const auto found = queues_.find(wire::lower(path));
  if (found == queues_.end() || found->second.values.empty()) return std::nullopt;
  const double value = found->second.values.front();
  found->second.values.pop_front();
  return value;
}

void EkiChannel::set(std::string_view path, std::string text) {
  values_[wire::lower(path)] = std::move(text);
}

void EkiChannel::send(std::string_view root) {
  if (!connected_) return;
  pugi::xml_document document;
  for (const std::string& path : config_.send) {
    const std::size_t at = path.find("/@");
    pugi::xml_node node = document;
    const std::string_view place = std::string_view(path).substr(0, at);
    if (!wire::same_name(place.substr(0, place.find('/')), root)) continue;
    for (std::size_t from = 0; from <= place.size();) {
      const std::size_t to = std::min(place.find('/', from), place.size());
      const std::string name(place.substr(from, to - from));
      pugi::xml_node next = node.child(name.c_str());
      node = next ? next : node.append_child(name.c_str());
      from = to + 1;
    }
    const auto value = values_.find(wire::lower(path));
    const char* text = value == values_.end() ? "" : value->second.c_str();
    if (at == std::string::npos) {
      node.text().set(text);
    } else {
      node.append_attribute(path.c_str() + at + 2).set_value(text);
    }
  }
  struct Collect : pugi::xml_writer {
    explicit Collect(std::string& to) : text(to) {}
    void write(const void* data, std::size_t size) override {
      text.append(static_cast<const char*>(data), size);
    }
    std::string& text;
  } collect(output_);
  document.save(collect, "", pugi::format_raw | pugi::format_no_declaration);
}

bool EkiChannel::connect() {
  if (!open_ || connected_) return false;
  connected_ = true;
  framer_.reset();
  output_.clear();
  return true;
}

void EkiChannel::drop_client() {
  connected_ = false;
  output_.clear();
}

void EkiChannel::disconnect() { drop_client(); }

void EkiChannel::overflow(const std::string& what) {
  if (messages_.size() < kMostMessages) {
    messages_.push_back("EKI: " + what + ", connection closed");
  }
  // Received values stay readable; the port has to be reopened.
  close();
}

void EkiChannel::receive(std::string_view bytes) {
  std::size_t size = 0;
  for (const char c : bytes) {
    if (!connected_) return;
    switch (framer_.push(c)) {
      case drivers::EkiFramer::Event::kNone: break;
      case drivers::EkiFramer::Event::kDocument:
        size = framer_.document().size();
        if (size > config_.bytes) return overflow("telegram longer than BUFFSIZE");
        take(framer_.document());
        break;
      case drivers::EkiFramer::Event::kOversized: return overflow("telegram without an end");
    }
  }
}

void EkiChannel::take(std::string_view text) {
  pugi::xml_document document;
  if (!document.load_buffer(text.data(), text.size(), pugi::parse_default, pugi::encoding_utf8)) {
    if (messages_.size() < kMostMessages) messages_.push_back("EKI: telegram is not XML, ignored");
    return;
  }
  const pugi::xml_node root = document.document_element();
  for (auto& [path, queue] : queues_) {
    const std::optional<std::string> found = text_at(root, path);
    if (!found) continue;
    double value = 0.0;
    const bool fits = queue.type == EkiElementType::kString || wire::parse_number(*found, value);
    const bool whole = queue.type == EkiElementType::kReal || is_whole(value);
    if (!fits || !whole) {
      if (messages_.size() < kMostMessages) {
        messages_.push_back("EKI: \"" + found->substr(0, 40) + "\" at " + path +
                            " is not of its type, ignored");
      }
      continue;
    }
    if (queue.values.size() >= config_.limit) return overflow("buffer of " + path + " is full");
    // KRL's REAL is a 32-bit float.
    queue.values.push_back(static_cast<double>(static_cast<float>(value)));
    if (queue.type == EkiElementType::kInt) queue.values.back() = value;
  }
}

std::string EkiChannel::drain_output() { return std::exchange(output_, {}); }

}  // namespace cellcal::sim
