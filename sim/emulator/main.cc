// The emulated cell on real wires: KRC over UDP, contact sensor on a pseudo-terminal.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <csignal>
#include <cstdio>

#include "calib/files/files.h"
#include "sim/cell/contact_watch.h"
#include "sim/emulator/options.h"
#include "sim/krc/krc_udp.h"
#include "sim/mcu/mcu_pty.h"

namespace {

using namespace cellcal;

int run(const sim::EmulatorOptions& options) {
  const calib::Cell cell = calib::load_cell(options.cell);
  const sim::PhysicalCell physical(sim::draw_truth(cell, options.truth));
  sim::ControllerConfig controller = options.controller;
  for (const calib::Joint& joint : cell.robot.joints)
    controller.max_speed_rad_s.push_back(joint.max_speed_rad_s);
  if (controller.start_rad.size() != cell.robot.joints.size())
    controller.start_rad.assign(cell.robot.joints.size(), 0.0);

  sim::McuPtyOptions pty;
  pty.mcu.baud = options.baud;
  pty.symlink = options.device_link;
  pty.mcu.drift_ppm = options.mcu_drift_ppm;
  sim::McuPty sensor(pty);
  sensor.set_faults(options.sensor_faults);
  sim::ContactWatch watch(physical,
                          [&](drivers::TimePoint t, bool closed) { sensor.edge(t, closed); });
  sim::KrcUdpOptions udp;
  udp.pc_address = options.pc_address;
  udp.pc_port = options.pc_port;
  udp.restart_after_s = options.restart_after_s;
  udp.realtime = true;
  sim::KrcUdp krc(controller, udp, [&](sim::Controller& c, drivers::TimePoint now) {
    if (!options.no_spheres)
      watch.look(now, now + c.cycle(), [&](drivers::TimePoint t) { return c.actual_rad_at(t); });
  });
  krc.start();
  fmt::print("emulator: {} axes, controller sends to {}:{}, contact sensor on {}\n",
             cell.robot.joints.size(), options.pc_address, options.pc_port,
             options.device_link.empty() ? sensor.path() : options.device_link);
  std::fflush(stdout);

  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGTERM);
  sigaddset(&signals, SIGINT);
  int caught = 0;
  sigwait(&signals, &caught);
  krc.stop();
  std::uint64_t packets = 0, late = 0;
  std::string message;
  krc.with([&](sim::Controller& c) {
    packets = c.packets();
    late = c.late_ever();
    message = c.message();
  });
  fmt::print(
      "emulator: {} packets in the last RSI session, {} late replies in all, deepest {:.3f} mm, "
      "{} crashes of the shaft{}\n",
      packets, late, watch.deepest_m() * 1e3, watch.crashes(),
      message.empty() ? "" : ", pendant: " + message);
  return watch.crashes() == 0 ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  // Blocked before any thread exists, so that sigwait is the only one to see them.
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGTERM);
  sigaddset(&signals, SIGINT);
  sigprocmask(SIG_BLOCK, &signals, nullptr);
  try {
    sim::EmulatorOptions options;
    CLI::App app(
        "The emulated cell on real wires: a KUKA controller over RSI/UDP and a contact "
        "sensor on a pseudo-terminal.\nExample: cellcal-emulator --cell cell.toml "
        "--pc 127.0.0.1:49152 --device-link /tmp/contact");
    sim::add_options(app, options);
    CLI11_PARSE(app, argc, argv);
    return run(options);
  } catch (const std::exception& e) {
    std::fprintf(stderr, "cellcal-emulator: %s\n", e.what());
    return 1;
  }
}
