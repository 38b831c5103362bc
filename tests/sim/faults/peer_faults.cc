// Faults of peers, counters and clocks: wrong IPOC, two on one port, drift, wraps.

#include <fmt/format.h>

#include "fault_lists.h"

namespace cellcal::faults {
namespace {

using sim::LineFaultKind;
using sim::Trouble;
using std::chrono::milliseconds;

constexpr std::uint64_t kWrap = std::uint64_t{1} << 32;
constexpr std::uint64_t kHalf = std::uint64_t{1} << 31;

void map_ipoc(std::string& text, const std::function<std::uint64_t(std::uint64_t)>& to) {
  constexpr std::string_view kTag = "<IPOC>";
  const std::size_t tag = text.find(kTag);
  if (tag == std::string::npos) return;
  const std::size_t from = tag + kTag.size(), end = text.find('<', from);
  text.replace(from, end - from, std::to_string(to(std::stoull(text.substr(from, end - from)))));
}

Trouble ipoc_trouble(TimePoint from, TimePoint until, int most,
                     const std::function<std::uint64_t(std::uint64_t)>& to) {
  Trouble trouble{LineFaultKind::kRewrite, from, until, 1.0, most};
  trouble.rewrite = [to](std::string& text) { map_ipoc(text, to); };
  return trouble;
}

void add_wrong_ipoc(std::vector<Fault>& all, Wire wire) {
  const char* reason = over_rsi(wire) ? nullptr : "EKI's telegrams carry no IPOC";
  struct Shape {
    const char* variant;
    int most;
    Duration lasts;
    std::uint64_t add;
  };
  const Shape shapes[] = {{"one, 1000 ahead", 1, milliseconds(1500), 1000},
                          {"one, a cycle behind", 1, milliseconds(1500), kWrap - 4},
                          {"all, 1000 ahead, for 1 s", -1, milliseconds(1000), 1000},
                          {"all, a million ahead, for good", -1, Duration::max(), 1'000'000}};
  for (const bool packets : {true, false}) {
    for (const Shape& shape : shapes) {
      Fault fault{"wrong IPOC", shape.variant, packets ? "RSI packets" : "RSI replies"};
      fault.book = [shape, packets](const Victim& victim) {
        const bool for_good = shape.lasts == Duration::max();
        (packets ? victim.cell.to_pc() : victim.cell.to_krc())
            .add(ipoc_trouble(victim.at, for_good ? TimePoint::max() : victim.at + shape.lasts,
                              shape.most,
                              [add = shape.add](std::uint64_t v) { return (v + add) % kWrap; }));
      };
      // If all replies are refused, there is no reply.
      if (!packets && shape.lasts == Duration::max()) fault.silences = Silent::kRobot;
      if (reason) fault.why_not = [reason](TouchPhase) { return reason; };
      all.push_back(std::move(fault));
    }
  }
}

void add_second_robot(std::vector<Fault>& all, Wire wire) {
  // The adapter's socket accepts only the first address (tested separately). Here both packets
  // arrive, as through one gateway.
  const char* where = over_rsi(wire) ? "RSI port, same address" : "EKI port, another client";
  for (const int ms : {100, 0}) {
    Fault fault{"second robot", ms ? fmt::format("for {} ms", ms) : "for good", where};
    fault.book = [ms](const Victim& victim) {
      FaultyCell& cell = victim.cell;
      cell.at(victim.at, [&cell] { cell.second_on_port(true); });
      if (ms) cell.at(victim.at + milliseconds(ms), [&cell] { cell.second_on_port(false); });
    };
    all.push_back(std::move(fault));
  }
  Fault first{"second robot", "there before", where};
  first.book = [](const Victim& victim) {
    FaultyCell& cell = victim.cell;
    cell.at(cell.power_on(), [&cell] { cell.second_on_port(true); });
  };
  first.why_not = [](TouchPhase phase) {
    return phase == TouchPhase::kConnect ? nullptr : "it holds the port before the session begins";
  };
  all.push_back(std::move(first));
}

/// Another computer that sends HELLO to the board, like a second daemon, ten times a second.
void add_second_host(std::vector<Fault>& all) {
  constexpr host_address kStranger{0x0200007F, 777};
  for (const int times : {1, 30}) {
    Fault fault{"second host", fmt::format("{} greetings", times), "Ethernet"};
    fault.book = [times, kStranger](const Victim& victim) {
      FaultyCell& cell = victim.cell;
      for (int i = 0; i < times; ++i) {
        cell.at(victim.at + milliseconds(100) * i, [&cell, i, kStranger] {
          const auto hello =
              drivers::ctp::build(drivers::ctp::Hello{1, 1, 7}, static_cast<std::uint8_t>(i));
          cell.mcu().receive(hello.bytes(), cell.now(), kStranger);
        });
      }
    };
    all.push_back(std::move(fault));
  }
}

void add_drift(std::vector<Fault>& all) {
  struct Shape {
    const char* variant;
    double mcu, krc;
  };
  const Shape shapes[] = {{"sensor +200 ppm", 200, 0},
                          {"sensor -200 ppm", -200, 0},
                          {"controller +200 ppm", 0, 200},
                          {"controller -200 ppm", 0, -200},
                          {"sensor +200 ppm, controller -200 ppm", 200, -200}};
  for (const Shape& shape : shapes) {
    Fault fault{"clock drift", shape.variant, "clocks, from here on"};
    fault.book = [shape](const Victim& victim) {
      FaultyCell& cell = victim.cell;
      cell.at(victim.at, [&cell, shape] {
        cell.mcu().set_drift(shape.mcu, cell.now());
        cell.krc_drift(shape.krc);
      });
    };
    all.push_back(std::move(fault));
    Fault always{"clock drift", shape.variant, "clocks, from power on"};
    always.before = [shape](CellOptions& options, TimePoint) {
      options.mcu_drift_ppm = shape.mcu;
      options.krc_drift_ppm = shape.krc;
    };
    always.why_not = [](TouchPhase phase) {
      return phase == TouchPhase::kConnect
                 ? nullptr
                 : "the whole session is under it: counted once, at connect";
    };
    all.push_back(std::move(always));
  }
}

/// Initial count such that it wraps at this instant.
std::uint64_t counts(const CellOptions& options, TimePoint at, Duration each) {
  return static_cast<std::uint64_t>((at - options.power_on) / each);
}

void add_wraps(std::vector<Fault>& all, Wire wire) {
  Fault mcu{"32-bit wrap", "of the sensor's ticks", "sensor"};
  mcu.before = [](CellOptions& options, TimePoint at) {
    options.mcu_ticks =
        static_cast<std::uint32_t>(kWrap - counts(options, at, std::chrono::nanoseconds(500)));
  };
  all.push_back(mcu);
  if (over_rsi(wire)) {
    const auto before = [](CellOptions& options, TimePoint at) {
      options.ipoc_start = (kWrap - counts(options, at, milliseconds(1))) / 4 * 4;
    };
    Fault passes{"32-bit wrap", "IPOC passes 2^32 and goes on", "controller"};
    passes.before = before;
    all.push_back(passes);
    Fault wraps{"32-bit wrap", "IPOC wraps to 0", "controller"};
    wraps.before = before;
    wraps.book = [](const Victim& victim) {
      FaultyCell& cell = victim.cell;
      cell.to_pc().add(ipoc_trouble(TimePoint{}, TimePoint::max(), -1,
                                    [](std::uint64_t v) { return v % kWrap; }));
      // The emulated controller itself continues counting: the difference is added back to its
      // replies.
      cell.to_krc().add(ipoc_trouble(TimePoint{}, TimePoint::max(), -1,
                                     [](std::uint64_t v) { return v < kHalf ? v + kWrap : v; }));
    };
    all.push_back(wraps);
  } else {
    Fault timer{"32-bit wrap", "$TIMER passes 2^31", "controller"};
    timer.before = [](CellOptions& options, TimePoint at) {
      options.power_on = TimePoint(milliseconds(kHalf)) - (at - options.power_on);
    };
    all.push_back(timer);
  }
}

}  // namespace

void add_peer_faults(std::vector<Fault>& all, Wire wire) {
  if (wire == Wire::kEthernet) return add_second_host(all);
  add_wrong_ipoc(all, wire);
  add_second_robot(all, wire);
  add_drift(all);
  add_wraps(all, wire);
}

}  // namespace cellcal::faults
