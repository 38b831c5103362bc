#include "daemon/controller/frame_record.h"

#include <fmt/format.h>

#include <array>
#include <charconv>
#include <cmath>
#include <nlohmann/json.hpp>
#include <stdexcept>

namespace cellcal::daemon {

namespace {

using drivers::EkiFrameKind;
using drivers::EkiFrameValues;
using nlohmann::json;

constexpr const char* kFormat = "cellcal.frames/1";
constexpr int kMostNumber = 128;  // of TOOL_DATA and BASE_DATA on any controller
constexpr std::array kOutcomes{FrameOutcome::kSet, FrameOutcome::kDiffers, FrameOutcome::kRefused,
                               FrameOutcome::kNotSent, FrameOutcome::kUnknown};

FrameRecord record_from(const json& one) {
  FrameRecord record;
  const auto values = [](const json& list) {
    const auto all = list.get<std::vector<double>>();
    EkiFrameValues frame{};
    if (all.size() != frame.size()) throw std::runtime_error("a frame must have six values");
    for (std::size_t i = 0; i < frame.size(); ++i) {
      if (!std::isfinite(all[i])) throw std::runtime_error("a frame's value is not finite");
      frame[i] = all[i];
    }
    return frame;
  };
  record.id = one.at("id").get<int>();
  if (record.id < 1) throw std::runtime_error("id must be at least 1");
  record.time = one.at("time").get<std::string>();
  record.by = one.at("by").get<std::string>();
  record.reason = one.at("reason").get<std::string>();
  record.words = one.at("words").get<std::string>();
  const auto name = frame_name(one.at("frame").get<std::string>());
  if (!name) throw std::runtime_error("frame is none");
  record.name = *name;
  record.before = values(one.at("before"));
  record.sent = values(one.at("sent"));
  if (!one.at("read_back").is_null()) record.read_back = values(one.at("read_back"));
  if (!one.at("restores").is_null()) record.restores = one.at("restores").get<int>();
  const auto outcome = one.at("outcome").get<std::string>();
  for (const FrameOutcome known : kOutcomes) {
    if (outcome != to_string(known)) continue;
    record.outcome = known;
    return record;
  }
  throw std::runtime_error("unknown outcome");
}

}  // namespace

const char* to_string(FrameOutcome outcome) {
  switch (outcome) {
    case FrameOutcome::kSet:
      return "set";
    case FrameOutcome::kDiffers:
      return "differs";
    case FrameOutcome::kRefused:
      return "refused";
    case FrameOutcome::kNotSent:
      return "not sent";
    case FrameOutcome::kUnknown:
      return "unknown";
  }
  return "";
}

std::string to_string(const FrameName& name) {
  return fmt::format("{}[{}]", name.kind == EkiFrameKind::kTool ? "TOOL_DATA" : "BASE_DATA",
                     name.number);
}

std::optional<FrameName> frame_name(std::string_view text) {
  FrameName name;
  if (text.starts_with("BASE_DATA[")) {
    name.kind = EkiFrameKind::kBase;
  } else if (!text.starts_with("TOOL_DATA[")) {
    return std::nullopt;
  }
  text.remove_prefix(std::string_view("TOOL_DATA[").size());
  const char* const last = text.data() + text.size();
  const auto [end, error] = std::from_chars(text.data(), last, name.number);
  if (error != std::errc() || end + 1 != last || *end != ']' || name.number < 1 ||
      name.number > kMostNumber)
    return std::nullopt;
  return name;
}

std::string krl_text(const EkiFrameValues& values) {
  const auto& v = values;
  return fmt::format("{{X {:.4f},Y {:.4f},Z {:.4f},A {:.5f},B {:.5f},C {:.5f}}}", v[0], v[1], v[2],
                     v[3], v[4], v[5]);
}

std::string frames_to_json(const std::vector<FrameRecord>& records) {
  json list = json::array();
  for (const FrameRecord& one : records) {
    list.push_back({{"id", one.id},
                    {"time", one.time},
                    {"by", one.by},
                    {"reason", one.reason},
                    {"frame", to_string(one.name)},
                    {"before", one.before},
                    {"sent", one.sent},
                    {"read_back", one.read_back ? json(*one.read_back) : json(nullptr)},
                    {"outcome", to_string(one.outcome)},
                    {"words", one.words},
                    {"restores", one.restores ? json(*one.restores) : json(nullptr)}});
  }
  return json{{"format", kFormat}, {"frames", std::move(list)}}.dump(
             1, ' ', false, json::error_handler_t::replace) +
         "\n";
}

std::vector<FrameRecord> frames_from_json(const std::string& text, const std::string& file) {
  const json all = json::parse(text, nullptr, false);
  if (!all.is_object() || all.value("format", json()) != kFormat || !all.contains("frames") ||
      !all["frames"].is_array())
    throw std::runtime_error(fmt::format("{}: is not {}", file, kFormat));
  std::vector<FrameRecord> records;
  for (const json& one : all["frames"]) {
    try {
      records.push_back(record_from(one));
      if (records.size() > 1 && records[records.size() - 2].id >= records.back().id)
        throw std::runtime_error("id must be above the one before");
    } catch (const std::exception& wrong) {
      throw std::runtime_error(
          fmt::format("{}: frames[{}]: {}", file, records.size(), wrong.what()));
    }
  }
  return records;
}

}  // namespace cellcal::daemon
