// Any bytes over TCP: the parsers return values, the adapter sends telegrams readable by a
// controller and requests no motion, and the emulated controller tolerates the same bytes.

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>

#include "drivers/kuka/eki/eki_aside.h"
#include "drivers/kuka/eki/eki_core.h"
#include "drivers/kuka/krl/krl_files.h"
#include "drivers/kuka/wire/eki_codec.h"
#include "sim/krc/eki_channel.h"

namespace {

using namespace cellcal::drivers;

void require(bool condition, const char* what) {
  if (condition) return;
  std::fprintf(stderr, "eki_fuzz: %s\n", what);
  std::abort();
}

void require_finite(const AxisAngles& values) {
  for (const double value : values) require(std::isfinite(value), "a value that is not finite");
}

EkiConfig config() {
  EkiConfig c;
  c.limits.assign(6, {-3.0, 3.0, 1.0, 5.0, 50.0});
  c.full_speed_rad_s.assign(6, 2.0);
  return c;
}

void check_output(EkiCore& core) {
  EkiFramer framer;
  std::size_t in_telegrams = 0;
  for (const char c : core.output()) {
    if (framer.push(c) == EkiFramer::Event::kDocument) {
      in_telegrams += framer.document().size();
      require(framer.document().find("Type=\"3\"") == std::string_view::npos, "a move");
    }
  }
  require(in_telegrams == core.output().size(), "output that is no telegram");
  core.sent(core.output().size());
}

void through_core(std::string_view bytes) {
  EkiCore core(config(), nullptr);
  TimePoint t{std::chrono::seconds(1)};
  core.on_tick(t);
  core.on_connected(7, t);
  // Twice, and in pieces: the second pass starts with the remainder of the first.
  for (int turn = 0; turn < 2; ++turn) {
    for (std::size_t from = 0; from < bytes.size(); from += 61) {
      t += std::chrono::milliseconds(1);
      core.on_bytes(bytes.substr(from, 61), t);
      core.on_tick(t);
      check_output(core);
    }
    core.begin({1, MoveKind::kTransit, AxisAngles(6, 0.1), 0.0, 0});
    core.on_tick(t);
    check_output(core);
    require(core.state().link != RobotLink::kReady, "ready without a reference");
    const auto result = core.poll();
    require(result && result->outcome == MoveOutcome::kRefused, "a move that was not refused");
    require_finite(result->at_rad);
  }
  core.rereference();
  core.on_bytes(bytes, t);
  core.on_closed(t);
  require(core.state().link != RobotLink::kReady, "ready without a connection");
}

/// For any answer, a frame counts as set only if it was read back as sent.
void through_frames(std::string_view bytes) {
  constexpr EkiFrameValues kSent{1.0, 2.0, 3.0, 4.0, 5.0, 6.0};
  constexpr std::uint32_t kAsk = 1;
  TimePoint t{std::chrono::seconds(1)};
  EkiFrameExchange exchange({EkiFrameKind::kTool, 3, kSent}, kAsk, t);
  const std::string at_rest =
      "<RobotState Session=\"0\" Heard=\"0\"><Axis A1=\"1\"/><Move Id=\"0\" State=\"0\" "
      "Outcome=\"0\"/><Status Ready=\"1\"/><Frame Ask=\"0\"/></RobotState>";
  for (int k = 0; k < 6; ++k) exchange.on_bytes(at_rest, t += std::chrono::milliseconds(100));
  require(!exchange.drain_output().empty(), "nothing was sent");
  for (std::size_t from = 0; from < bytes.size(); from += 61)
    exchange.on_bytes(bytes.substr(from, 61), t);
  exchange.on_closed();
  require(exchange.result().has_value(), "no result behind the end");
  if (exchange.result()->end == EkiFrameEnd::kSet)
    require(same_frame(kSent, *exchange.result()->new_values), "set, and read back otherwise");
  require(exchange.result()->end != EkiFrameEnd::kNotSent, "sent, and said that it was not");
}

void through_channel(std::string_view bytes) {
  static const std::string xml = eki_files({}).at("CellcalEki.xml");
  static const auto parsed = cellcal::sim::EkiChannelConfig::parse(xml);
  cellcal::sim::EkiChannel channel(parsed);
  channel.open();
  channel.connect();
  channel.receive(bytes);
  for (const auto& [path, type] : parsed.receive) {
    require(channel.waiting(path) <= parsed.limit, "more than the limit");
    while (const auto value = channel.get(path)) require(std::isfinite(*value), "not finite");
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static EkiParser parser;
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  EkiFramer framer;
  EkiState state;
  for (const char c : bytes) {
    const EkiFramer::Event event = framer.push(c);
    if (event == EkiFramer::Event::kOversized) break;
    if (event != EkiFramer::Event::kDocument) continue;
    require(framer.document().size() <= kMaxEkiDocument, "a document beyond its limit");
    if (parser.parse_state(framer.document(), state) == EkiError::kNone) {
      require(!state.axes_deg.empty(), "accepted without axes");
      require_finite(state.axes_deg);
      require_finite(state.latch_deg);
    }
  }
  if (parser.parse_state(bytes, state) == EkiError::kNone) require_finite(state.axes_deg);
  through_core(bytes);
  through_frames(bytes);
  through_channel(bytes);
  return 0;
}
