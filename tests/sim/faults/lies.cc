// Faults of content: one part of a message is false, and contradicted by all others.

#include <fmt/format.h>

#include "drivers/contact/wire/ctp_codec.h"
#include "fault_lists.h"

namespace cellcal::faults {
namespace {

using drivers::ctp::Direction;
using sim::LineFaultKind;
using sim::Trouble;
using std::chrono::milliseconds;

/// `by` is added to the number of this attribute of an RSI packet.
void shift(std::string& text, std::string_view element, std::string_view attribute, double by) {
  const std::size_t tag = text.find(fmt::format("<{} ", element));
  if (tag == std::string::npos) return;
  const std::string name = fmt::format("{}=\"", attribute);
  const std::size_t from = text.find(name, tag) + name.size(), end = text.find('"', from);
  const double value = std::stod(text.substr(from, end - from)) + by;
  text.replace(from, end - from, fmt::format("{:.{}f}", value, element == "Delay" ? 0 : 4));
}

struct Lie {
  std::string variant;
  const char* where;
  std::function<void(std::string&)> distort;
  int most = -1;       ///< maximum number of messages; negative: all
  Duration lasts{};    ///< 0: permanent
  double share = 1.0;  ///< of them
};

void add(std::vector<Fault>& all, const Lie& lie, const char* reason,
         const std::function<sim::Line&(FaultyCell&)>& line) {
  Fault fault{"a part that lies", lie.variant, lie.where};
  fault.book = [lie, line](const Victim& victim) {
    const TimePoint until = lie.lasts == Duration{} ? TimePoint::max() : victim.at + lie.lasts;
    Trouble trouble{LineFaultKind::kRewrite, victim.at, until, lie.share, lie.most};
    trouble.rewrite = lie.distort;
    line(victim.cell).add(trouble);
  };
  fault.replies_arrive = true;
  if (reason != nullptr) fault.why_not = [reason](TouchPhase) { return reason; };
  all.push_back(std::move(fault));
}

void add_packets(std::vector<Fault>& all, Wire wire) {
  const char* reason = over_rsi(wire) ? nullptr : "EKI's states have no such part";
  const auto shifts = [](const char* element, const char* attribute, double by) {
    return [=](std::string& text) { shift(text, element, attribute, by); };
  };
  const auto renames = [](std::string& text) {
    if (const auto at = text.find("<AIPos"); at != std::string::npos) text.replace(at, 6, "<Other");
  };
  const auto spoils = [](std::string& text) {
    const auto at = text.find("A2=\"", text.find("<AIPos"));
    if (at != std::string::npos) text.replace(at + 4, 3, "nan");
  };
  std::vector<Lie> lies;
  for (const double deg : {0.03, 1.0, 30.0}) {
    for (const int ms : {0, 300})
      lies.push_back({fmt::format("ASPos {} deg off, {}", deg, ms ? "for 0.3 s" : "for good"),
                      "RSI packets", shifts("ASPos", "A2", deg), -1, milliseconds(ms)});
  }
  for (const double deg : {1.0, 30.0})
    lies.push_back(
        {fmt::format("AIPos {} deg off, once", deg), "RSI packets", shifts("AIPos", "A2", deg), 1});
  for (const int by : {-1, 1, 5})
    lies.push_back(
        {fmt::format("Delay {:+}, once", by), "RSI packets", shifts("Delay", "D", by), 1});
  lies.push_back({"no AIPos, once", "RSI packets", renames, 1});
  lies.push_back(
      {"no AIPos, in a fifth of the packets", "RSI packets", renames, -1, milliseconds(1500), 0.2});
  lies.push_back({"no AIPos, in ten packets", "RSI packets", renames, 10});
  lies.push_back({"no AIPos, for good", "RSI packets", renames});
  lies.push_back({"AIPos 'nan', in a tenth of the packets", "RSI packets", spoils, -1,
                  milliseconds(1500), 0.1});
  for (const Lie& lie : lies)
    add(all, lie, reason, [](FaultyCell& cell) -> sim::Line& { return cell.to_pc(); });
}

/// Frames of these types are stamped earlier by this, with a valid CRC.
void rewrite_event(std::string& wire, const std::function<bool(std::uint8_t)>& which,
                   double early_s) {
  drivers::ctp::FrameReader reader(Direction::kFromSensor);
  for (const char byte : wire) {
    const drivers::ctp::Frame* frame = reader.feed(static_cast<std::uint8_t>(byte));
    if (frame == nullptr || !which(frame->type)) continue;
    const auto ticks = static_cast<std::uint32_t>(early_s * CTP_TICKS_PER_S);
    const auto put = [&](const drivers::ctp::WireBytes& made) {
      wire.assign(made.bytes().begin(), made.bytes().end());
    };
    if (frame->type == CTP_TRIP) {
      auto trip = drivers::ctp::read<drivers::ctp::Trip>(*frame);
      trip.t -= ticks;
      return put(drivers::ctp::build(trip, frame->seq));
    }
    auto event = drivers::ctp::read<drivers::ctp::Event>(*frame);
    event.t_first -= ticks;
    return put(drivers::ctp::build(event, frame->seq, frame->type));
  }
}

void add_sensor(std::vector<Fault>& all) {
  const auto events = [](std::uint8_t type) { return type == CTP_TRIP || type == CTP_CONTACT; };
  for (const int ms : {30, 100, 200}) {
    Lie lie{fmt::format("contacts stamped {} ms early", ms), "serial line, sensor to PC",
            [=](std::string& wire) { rewrite_event(wire, events, 1e-3 * ms); }};
    add(all, lie, nullptr, [](FaultyCell& cell) -> sim::Line& { return cell.serial().to_host(); });
  }
  const auto loses = [](auto which) {
    return [which](std::string& wire) {
      drivers::ctp::FrameReader reader(Direction::kFromSensor);
      for (const char byte : std::string(wire)) {
        const drivers::ctp::Frame* frame = reader.feed(static_cast<std::uint8_t>(byte));
        if (frame != nullptr && which(frame->type)) wire[1] = static_cast<char>(wire[1] ^ 0x15);
      }
    };
  };
  add(all, {"trips damaged", "serial line, sensor to PC", loses([](std::uint8_t type) {
              return type == CTP_TRIP;
            })},
      nullptr, [](FaultyCell& cell) -> sim::Line& { return cell.serial().to_host(); });
  add(all, {"trips and contacts damaged", "serial line, sensor to PC", loses(events)}, nullptr,
      [](FaultyCell& cell) -> sim::Line& { return cell.serial().to_host(); });
}

}  // namespace

void add_lies(std::vector<Fault>& all, Wire wire) {
  add_packets(all, wire);
  add_sensor(all);
}

}  // namespace cellcal::faults
