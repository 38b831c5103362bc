// Faults of the lines: loss, delay, duplication, reordering, damage, disconnection.

#include <fmt/format.h>

#include "fault_lists.h"

namespace cellcal::faults {
namespace {

using sim::LineFaultKind;
using sim::Trouble;
using std::chrono::microseconds;
using std::chrono::milliseconds;

struct LineOf {
  const char* where;
  sim::LineKind kind;
  bool sensor, hears_sensor, commands;
  std::vector<std::function<sim::Line&(FaultyCell&)>> lines;
};

sim::Line& to_pc(FaultyCell& cell) { return cell.to_pc(); }
sim::Line& to_krc(FaultyCell& cell) { return cell.to_krc(); }
sim::Line& from_sensor(FaultyCell& cell) { return cell.serial().to_host(); }
sim::Line& to_sensor(FaultyCell& cell) { return cell.serial().to_device(); }

std::vector<LineOf> directions(Wire wire) {
  if (wire == Wire::kEthernet) {
    constexpr sim::LineKind kind = sim::LineKind::kDatagrams;
    return {{"Ethernet, from the sensor", kind, true, true, false, {from_sensor}},
            {"Ethernet, to the sensor", kind, true, false, false, {to_sensor}}};
  }
  const bool rsi = over_rsi(wire);
  const sim::LineKind kind = rsi ? sim::LineKind::kDatagrams : sim::LineKind::kStream;
  return {{rsi ? "RSI packets" : "EKI states", kind, false, false, false, {to_pc}},
          {rsi ? "RSI replies" : "EKI commands", kind, false, false, true, {to_krc}},
          {"serial, from the sensor", sim::LineKind::kFrames, true, true, false, {from_sensor}},
          {"serial, to the sensor", sim::LineKind::kFrames, true, false, false, {to_sensor}}};
}

std::vector<LineOf> cables(Wire wire) {
  if (wire == Wire::kEthernet) {
    return {
        {"Ethernet cable", sim::LineKind::kDatagrams, true, true, false, {from_sensor, to_sensor}}};
  }
  const bool rsi = over_rsi(wire);
  const sim::LineKind kind = rsi ? sim::LineKind::kDatagrams : sim::LineKind::kStream;
  return {{rsi ? "RSI cable" : "EKI cable", kind, false, false, false, {to_pc, to_krc}},
          {"serial cable", sim::LineKind::kFrames, true, true, false, {from_sensor, to_sensor}}};
}

struct Shape {
  const char* name;
  std::string variant;
  LineFaultKind kind;
  Duration lasts;  ///< Duration::max(): permanent
  double share = 1.0;
  int most = -1;
  Duration delay{};
};

Fault line_fault(const LineOf& line, const Shape& shape) {
  Fault fault{shape.name, shape.variant, line.where};
  fault.book = [line, shape](const Victim& victim) {
    const bool for_good = shape.lasts == Duration::max();
    Trouble trouble{shape.kind,  victim.at,  for_good ? TimePoint::max() : victim.at + shape.lasts,
                    shape.share, shape.most, shape.delay};
    for (const auto& of : line.lines) of(victim.cell).add(trouble);
  };
  return fault;
}

/// Those of a telegram; of the axes' angles; of the report on the move.
enum class Numbers { kAll, kAxes, kMove };

/// A digit of the telegram is changed: valid XML with another number.
void change_a_digit(std::string& text, Numbers of, std::uint64_t& state) {
  const std::size_t move = text.find("<Move"),
                    move_end = text.find('>', std::min(move, text.size()));
  std::vector<std::size_t> digits;
  std::string name;  // of the attribute whose value this is
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '=' && i >= 2) name = text.substr(i - 2, 2);
    const bool axis = name.size() == 2 && name[0] == 'A' && name[1] >= '1' && name[1] <= '6';
    const bool wanted = of == Numbers::kAll || (of == Numbers::kAxes && axis) ||
                        (of == Numbers::kMove && i > move && i < move_end);
    if (text[i] >= '0' && text[i] <= '9' && wanted) digits.push_back(i);
  }
  if (digits.empty()) return;
  state = state * 6364136223846793005u + 1442695040888963407u;
  char& digit = text[digits[(state >> 33) % digits.size()]];
  digit = static_cast<char>('0' + (digit - '0' + 1 + static_cast<int>((state >> 20) % 9)) % 10);
}

const char* no_stream(sim::LineKind kind) {
  return kind == sim::LineKind::kStream
             ? "TCP hands over every byte once and in order, or ends the connection"
             : nullptr;
}

void add_digits(std::vector<Fault>& all, const LineOf& line) {
  if (line.sensor) return;  // any byte is a number there
  const std::pair<Numbers, const char*> all_numbers[] = {
      {Numbers::kAll, "a"}, {Numbers::kAxes, "an axis'"}, {Numbers::kMove, "a move report's"}};
  for (const auto& [of, whose] : all_numbers) {
    if (of == Numbers::kMove && line.kind != sim::LineKind::kStream) continue;
    for (const int count : {1, 10}) {
      Fault fault{"corrupt", fmt::format("{} digit, {} times", whose, count), line.where};
      fault.book = [line, count, numbers = of](const Victim& victim) {
        auto state = std::make_shared<std::uint64_t>(
            static_cast<std::uint64_t>(victim.at.time_since_epoch().count()));
        Trouble trouble{LineFaultKind::kRewrite, victim.at, TimePoint::max(), 1.0, count};
        trouble.rewrite = [=](std::string& text) { change_a_digit(text, numbers, *state); };
        for (const auto& from : line.lines) from(victim.cell).add(trouble);
      };
      if (line.kind == sim::LineKind::kStream && line.commands) {
        fault.why_not = [](TouchPhase) {
          return "TCP's checksum alone keeps another number out of a command: the controller's "
                 "program has no means to tell it from the right one";
        };
      }
      all.push_back(std::move(fault));
    }
  }
}

/// A sensor that does not receive still sends: this fault stops nothing.
std::optional<Silent> silences(const LineOf& line) {
  if (!line.sensor) return Silent::kRobot;
  if (line.hears_sensor) return Silent::kSensor;
  return std::nullopt;
}

}  // namespace

void add_line_faults(std::vector<Fault>& all, Wire wire) {
  constexpr milliseconds kLong{1500};
  for (const LineOf& line : directions(wire)) {
    const auto add = [&](const Shape& shape, const char* reason = nullptr) {
      all.push_back(line_fault(line, shape));
      if (reason) all.back().why_not = [reason](TouchPhase) { return reason; };
    };
    add({"drop", "one", LineFaultKind::kDrop, kLong, 1.0, 1});
    add({"drop", "three in a row", LineFaultKind::kDrop, kLong, 1.0, 3});
    add({"drop", "every fifth for 1.5 s", LineFaultKind::kDrop, kLong, 0.2});
    for (const int ms : {1, 5, 20, 100}) {
      add({"delay", fmt::format("{} ms for 1.5 s", ms), LineFaultKind::kDelay, kLong, 1.0, -1,
           milliseconds(ms)});
    }
    if (wire == Wire::kRsiInput) {
      for (const int ms : {300, 500}) {
        add({"delay", fmt::format("{} ms for 1.5 s", ms), LineFaultKind::kDelay, kLong, 1.0, -1,
             milliseconds(ms)});
      }
      add({"drop", "all for 300 ms", LineFaultKind::kDrop, milliseconds(300)});
    }
    add({"delay", "up to 100 ms, every fifth for 1.5 s", LineFaultKind::kDelay, kLong, 0.2, -1,
         milliseconds(100)});
    const char* reason = no_stream(line.kind);
    add({"duplicate", "0.5 ms later, for 0.5 s", LineFaultKind::kDuplicate, milliseconds(500), 1.0,
         -1, microseconds(500)},
        reason);
    add({"duplicate", "10 ms later, every fifth for 1.5 s", LineFaultKind::kDuplicate, kLong, 0.2,
         -1, milliseconds(10)},
        reason);
    if (line.kind == sim::LineKind::kFrames) {
      reason = "bytes on a serial cable cannot overtake each other";
    }
    add({"reorder", "every fifth by 6 ms, for 1.5 s", LineFaultKind::kReorder, kLong, 0.2, -1,
         milliseconds(6)},
        reason);
    add({"reorder", "one by 30 ms", LineFaultKind::kReorder, kLong, 1.0, 1, milliseconds(30)},
        reason);
    add({"corrupt", "a byte of one", LineFaultKind::kCorrupt, kLong, 1.0, 1});
    add({"corrupt", "a byte of every fifth for 1.5 s", LineFaultKind::kCorrupt, kLong, 0.2});
    add_digits(all, line);
    add({"truncate", "one", LineFaultKind::kTruncate, kLong, 1.0, 1});
    add({"truncate", "every fifth for 1.5 s", LineFaultKind::kTruncate, kLong, 0.2});
  }
  std::vector<LineOf> lines = cables(wire);
  for (LineOf& line : directions(wire)) lines.push_back(std::move(line));
  for (const LineOf& line : lines) {
    all.push_back(line_fault(line, {"unplug", "for good", LineFaultKind::kCut, Duration::max()}));
    all.back().silences = silences(line);
    for (const int ms : {10, 60, 400, 2000}) {
      all.push_back(line_fault(line, {"reconnect", fmt::format("after {} ms", ms),
                                      LineFaultKind::kCut, milliseconds(ms)}));
      if (ms >= 2000) all.back().silences = silences(line);
    }
  }
}

}  // namespace cellcal::faults
