// Reads, sets and restores frames of the controller (/v1/frames), and reads the position of the arm (/v1/position). No
// session runs meanwhile.

#include <spdlog/spdlog.h>

#include <nlohmann/json.hpp>

#include "calib/files/json.h"
#include "daemon/api/handlers.h"
#include "daemon/api/http/http.h"
#include "daemon/controller/frame_station.h"
#include "daemon/files/atomic_file.h"

namespace cellcal::daemon {

namespace {

using drivers::EkiFrameValues;
using nlohmann::json;

constexpr const char* kHold = "a frame of the controller is being read or set";

json values_json(const EkiFrameValues& v) {
  return {{"xyz_mm", {v[0], v[1], v[2]}}, {"abc_deg", {v[3], v[4], v[5]}}};
}

json to_json(const FrameRecord& one) {
  return {{"id", one.id},
          {"time", one.time},
          {"by", one.by},
          {"reason", one.reason},
          {"frame", to_string(one.name)},
          {"before", values_json(one.before)},
          {"sent", values_json(one.sent)},
          {"read_back", one.read_back ? values_json(*one.read_back) : json(nullptr)},
          {"outcome", to_string(one.outcome)},
          {"words", one.words},
          {"restores", one.restores ? json(*one.restores) : json(nullptr)}};
}

FrameName name_in(const json& body) {
  const auto name = body.contains("frame") && body["frame"].is_string()
                        ? frame_name(body["frame"].get<std::string>())
                        : std::nullopt;
  if (!name)
    throw BadRequest("\"frame\" must be like \"TOOL_DATA[3]\" or \"BASE_DATA[12]\", 1 to 128");
  return *name;
}

/// {"xyz_mm": [1, 2, 3], "abc_deg": [4, 5, 6]}, and no other key.
EkiFrameValues values_in(const json& body, const char* key) {
  EkiFrameValues values{};
  const json given = body.value(key, json());
  bool sound = given.is_object() && given.size() == 2;
  std::size_t at = 0;
  for (const char* part : {"xyz_mm", "abc_deg"}) {
    const json list = sound ? given.value(part, json()) : json();
    sound = sound && list.is_array() && list.size() == 3;
    for (std::size_t i = 0; sound && i < 3; ++i) {
      sound = list[i].is_number();
      if (sound) values[at++] = list[i].get<double>();
    }
  }
  if (!sound)
    throw BadRequest(std::string("\"") + key +
                     R"(" must be {"xyz_mm": [X, Y, Z], "abc_deg": [A, B, C]}, numbers)");
  return values;
}

void require_confirmed(const json& body) {
  if (body.value("confirm", json()) != true)
    throw BadRequest(R"("confirm" must be true: every point taught in the frame moves with it)");
}

template <class Act>
auto sent(Act act) {
  try {
    return act();
  } catch (const FrameNotSent& not_sent) {
    using Why = FrameNotSent::Why;
    switch (not_sent.why) {
      case Why::kNotConfigured:
      case Why::kNoSuchRecord: throw NotFound(not_sent.what());
      case Why::kUnusable: throw RequestError(not_sent.what());
      case Why::kChanged:
      case Why::kController: throw BusyError(not_sent.what());
      case Why::kStorage: break;
    }
    throw;
  }
}

/// Success only for a frame that was read back as it was sent.
Response answer_of(const FrameRecord& record) {
  const bool set = record.outcome == FrameOutcome::kSet;
  spdlog::log(set ? spdlog::level::info : spdlog::level::warn, "frame {} by {}: {}", record.id,
              record.by, record.words);
  json body = to_json(record);
  if (!set) body["error"] = record.words;
  return Response{set ? 201 : 502, "application/json", dump(body)};
}

FrameStation& frames_of(const Api& api) {
  if (api.frames == nullptr) throw NotFound("setting frames is off");
  return *api.frames;
}

Answer show_frames(Api& api, const Call&) {
  json list = json::array();
  for (const FrameRecord& one : frames_of(api).records()) list.push_back(to_json(one));
  return Response{
      .body = dump({{"configured", frames_of(api).configured()},
                    {"problem", frames_of(api).problem().empty() ? json(nullptr)
                                                                 : json(frames_of(api).problem())},
                    {"frames", std::move(list)}})};
}

Answer read_frame(Api& api, const Call& call) {
  const FrameName name = name_in(object_in(call.request.body, {"frame"}));
  EkiFrameValues values{};
  sent([&] { api.service.alone(kHold, [&] { values = frames_of(api).read(name); }); });
  json body = values_json(values);
  body["frame"] = to_string(name);
  return Response{.body = dump(body)};
}

Answer set_frame(Api& api, const Call& call) {
  const json body =
      object_in(call.request.body, {"frame", "values", "was", "reason", "by", "confirm"});
  require_confirmed(body);
  const FrameOrder order{name_in(body), values_in(body, "values"), values_in(body, "was"),
                         author_of(call.request, body), line_in(body, "reason", kLongestReason)};
  FrameRecord record;
  sent([&] { api.service.alone(kHold, [&] { record = frames_of(api).set(order); }); });
  return answer_of(record);
}

Answer restore_frame(Api& api, const Call& call) {
  const json body = object_in(call.request.body, {"id", "by", "confirm"});
  require_confirmed(body);
  const json id = body.value("id", json());
  constexpr int kMostId = 1'000'000'000;
  if (!id.is_number_integer() || id < 1 || id > kMostId)
    throw BadRequest("\"id\" must be the number of a frame that was sent");
  const std::string by = author_of(call.request, body);
  FrameRecord record;
  sent([&] {
    api.service.alone(kHold, [&] { record = frames_of(api).restore(id.get<int>(), by); });
  });
  return answer_of(record);
}

// Current position of the arm, for teaching: no session runs meanwhile; causes no motion.

Answer read_position(Api& api, const Call&) {
  const Api::ReadPosition read = api.position ? api.position() : nullptr;
  if (!read) throw NotFound(no_position_words());
  drivers::EkiPosition position;
  api.service.alone("reading the arm's position", [&] { position = read(); });
  if (position.trouble != drivers::EkiPositionTrouble::kNone)
    throw BusyError(position_words(position));
  return Response{.body = dump({{"axes_deg", position.axes_deg}})};
}

}  // namespace

std::span<const Api::Route> frame_routes() {
  static constexpr Api::Route kRoutes[] = {
      {"GET", "/v1/frames", Role::kView, kSlow, show_frames},
      {"POST", "/v1/frames/read", Role::kAdminister, kSlow, read_frame},
      {"POST", "/v1/frames", Role::kAdminister, kSlow, set_frame},
      {"POST", "/v1/frames/restore", Role::kAdminister, kSlow, restore_frame},
      {"POST", "/v1/position", Role::kOperate, kSlow, read_position},
  };
  return kRoutes;
}

}  // namespace cellcal::daemon
