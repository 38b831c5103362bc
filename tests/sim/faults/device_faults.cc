// Faults of the touch circuit, the sensor, the robot, and operator actions.

#include <fmt/format.h>

#include "fault_lists.h"

namespace cellcal::faults {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;

using Act = std::function<void(FaultyCell&)>;

Fault& add(std::vector<Fault>& all, const char* name, std::string variant, const char* where,
           Act act) {
  Fault fault{name, std::move(variant), where};
  fault.book = [act = std::move(act)](const Victim& victim) {
    FaultyCell& cell = victim.cell;
    cell.at(victim.at, [&cell, act] { act(cell); });
  };
  all.push_back(std::move(fault));
  return all.back();
}

/// On at the fault's instant, off after `ms`; 0: permanent.
Fault& add_switch(std::vector<Fault>& all, const char* name, const char* what, int ms,
                  const char* where, std::function<void(FaultyCell&, bool)> turn) {
  const std::string lasts = ms ? fmt::format("{}, for {} ms", what, ms) : std::string(what);
  return add(all, name, lasts, where, [turn = std::move(turn), ms](FaultyCell& cell) {
    turn(cell, true);
    if (ms) cell.at(cell.now() + milliseconds(ms), [&cell, turn] { turn(cell, false); });
  });
}

void change(FaultyCell& cell, const std::function<void(sim::McuFaults&)>& what) {
  sim::McuFaults faults = cell.mcu().faults();
  what(faults);
  cell.mcu().set_faults(faults, cell.now());
}

void silence(FaultyCell& cell, bool on) {
  change(cell, [on](sim::McuFaults& faults) { faults.silent = on; });
}

void add_circuit(std::vector<Fault>& all) {
  for (const auto& [count, apart] :
       {std::pair{3, microseconds(50)}, {6, microseconds(300)}, {2, microseconds(1500)}}) {
    Fault fault{"bounce", fmt::format("{} times, {} us", count, apart.count()), "touch circuit"};
    fault.book = [count = count, apart = apart](const Victim& victim) {
      FaultyCell& cell = victim.cell;
      // Active before the edge concerned.
      cell.at(victim.at - milliseconds(20), [&cell, count, apart] { cell.bounce(count, apart); });
    };
    fault.why_not = [](TouchPhase phase) -> const char* {
      if (phase == TouchPhase::kContact || phase == TouchPhase::kRetreat) return nullptr;
      return "the circuit neither closes nor opens in this phase: nothing bounces";
    };
    all.push_back(std::move(fault));
  }
  struct Noise {
    int count;
    microseconds pulse, apart;
  };
  for (const Noise& noise : {Noise{20, microseconds(100), microseconds(1000)},
                             Noise{30, microseconds(3000), microseconds(7000)},
                             Noise{1, microseconds(20000), microseconds(20000)}}) {
    add(all, "chatter", fmt::format("{} pulses of {} us", noise.count, noise.pulse.count()),
        "touch circuit",
        [noise](FaultyCell& cell) { cell.chatter(noise.count, noise.pulse, noise.apart); });
  }
  for (const int ms : {0, 200}) {
    add_switch(all, "stuck contact", "short circuit", ms, "touch circuit",
               [](FaultyCell& cell, bool on) { cell.short_circuit(on); });
    add_switch(all, "stuck contact", "sensor's input stuck open", ms, "touch circuit",
               [](FaultyCell& cell, bool on) {
                 change(cell, [on](sim::McuFaults& f) { f.circuit.capture_joint_open = on; });
               });
    add_switch(all, "wire break", "sense wire", ms, "touch circuit", [](FaultyCell& cell, bool on) {
      const sim::TouchCircuit whole;
      change(cell, [&](sim::McuFaults& f) {
        f.circuit.sense_wire = on ? sim::TouchCircuit::kOpen : whole.sense_wire;
      });
    });
  }
}

void add_boot(std::vector<Fault>& all) {
  add(all, "boot in mid-search", "reset", "sensor",
      [](FaultyCell& cell) { cell.mcu().reset(cell.now()); });
  add(all, "boot in mid-search", "watchdog reset, three times", "sensor", [](FaultyCell& cell) {
    for (const int ms : {0, 300, 600}) {
      cell.at(cell.now() + milliseconds(ms),
              [&cell] { cell.mcu().reset(cell.now(), CTP_RESET_WATCHDOG); });
    }
  });
  for (const int ms : {0, 60}) {
    add_switch(all, "boot in mid-search", "hangs", ms, "sensor", silence);
    if (ms == 0) all.back().silences = Silent::kSensor;
  }
  add(all, "boot in mid-search", "hangs for 60 ms, then reset", "sensor", [](FaultyCell& cell) {
    silence(cell, true);
    cell.at(cell.now() + milliseconds(60), [&cell] {
      silence(cell, false);
      cell.mcu().reset(cell.now());
    });
  });
}

void add_input(std::vector<Fault>& all) {
  for (const int ms : {0, 200}) {
    add_switch(all, "second stop path", "input stuck at free", ms, "controller",
               [](FaultyCell& cell, bool on) { cell.input_stuck_on(on); });
  }
  add_switch(all, "second stop path", "wire cut", 200, "controller",
             [](FaultyCell& cell, bool on) { cell.input_wire(on); });
  for (const int ms : {12, 40, 100}) {
    add(all, "second stop path", fmt::format("input {} ms late", ms), "controller",
        [ms](FaultyCell& cell) { cell.input_late(milliseconds(ms)); });
  }
  add(all, "second stop path", "input stuck at free and bytes 300 ms late",
      "controller and serial line", [](FaultyCell& cell) {
        cell.input_stuck_on(true);
        cell.serial().to_host().add({sim::LineFaultKind::kDelay, cell.now(),
                                     cell.now() + milliseconds(1500), 1.0, -1, milliseconds(300)});
      });
}

void add_robot(std::vector<Fault>& all, Wire wire) {
  const bool eki = !over_rsi(wire);
  add_switch(all, "robot fault", "drives off", 0, "controller", [](FaultyCell& cell, bool on) {
    cell.block_drives(on);
  }).silences = Silent::kRobot;
  if (!eki) {
    add_switch(all, "robot fault", "drives off", 30, "controller",
               [](FaultyCell& cell, bool on) { cell.block_drives(on); });
  }
  add_switch(all, "robot fault", "power off", 0, "controller", [](FaultyCell& cell, bool on) {
    cell.power_off(on);
  }).silences = Silent::kRobot;
  if (eki) {
    add(all, "robot fault", "program ended by a message", "controller", [](FaultyCell& cell) {
      cell.robot_fault();
    }).silences = Silent::kRobot;
  }
  if (wire == Wire::kEkiInput || wire == Wire::kRsiInput || wire == Wire::kEkiTrack ||
      wire == Wire::kEkiTable) {
    add_switch(all, "wire break", "to the controller's input", 0, "touch circuit",
               [](FaultyCell& cell, bool on) { cell.input_wire(on); });
  }
  if (wire == Wire::kRsiInput) add_input(all);
  // A carriage that continues permanently could not rest.
  const std::vector<int> lasts = on_track(wire) || on_table(wire) ? std::vector{40, 200}
                                 : wire == Wire::kEkiInput        ? std::vector{0, 200}
                                                                  : std::vector<int>{};
  for (const int ms : lasts)
    add_switch(all, "external axis", "moves unasked", ms, "controller",
               [](FaultyCell& cell, bool on) { cell.external_axis_moves(on); });
}

void add_operator(std::vector<Fault>& all) {
  Fault abort{"operator's stop", "cellcal abort", "session"};
  abort.book = [](const Victim& victim) {
    victim.cell.at(victim.at, [runner = victim.runner] { runner->request_abort(); });
  };
  abort.asks_for_end = true;
  abort.silences = Silent::kHand;
  all.push_back(abort);
  add(all, "operator's stop", "emergency stop", "pendant", [](FaultyCell& cell) {
    cell.operator_stops();
  }).silences = Silent::kRobot;
  add(all, "operator's stop", "stop by another program", "driver",
      [](FaultyCell& cell) { cell.robot().stop(); });
}

}  // namespace

void add_device_faults(std::vector<Fault>& all, Wire wire) {
  add_circuit(all);
  add_boot(all);
  if (wire == Wire::kEthernet) return;  // the remainder does not concern the sensor's line
  add_robot(all, wire);
  add_operator(all);
}

const char* to_string(TouchPhase phase) {
  switch (phase) {
    case TouchPhase::kConnect: return "connect";
    case TouchPhase::kTransit: return "transit";
    case TouchPhase::kApproach: return "approach";
    case TouchPhase::kSearch: return "search";
    case TouchPhase::kContact: return "contact";
    case TouchPhase::kLatch: return "latch";
    case TouchPhase::kRetreat: return "retreat";
  }
  return "?";
}

std::vector<Fault> faults_of(Wire wire) {
  std::vector<Fault> all;
  add_line_faults(all, wire);
  add_peer_faults(all, wire);
  add_device_faults(all, wire);
  if (wire != Wire::kEthernet) add_lies(all, wire);
  return all;
}

std::vector<std::string> fault_names() {
  return {"drop",
          "delay",
          "duplicate",
          "reorder",
          "corrupt",
          "truncate",
          "unplug",
          "reconnect",
          "wrong IPOC",
          "second robot",
          "second host",
          "clock drift",
          "32-bit wrap",
          "bounce",
          "chatter",
          "stuck contact",
          "wire break",
          "second stop path",
          "boot in mid-search",
          "robot fault",
          "external axis",
          "operator's stop",
          "a part that lies"};
}

}  // namespace cellcal::faults
