// The emulated cell on real interfaces: KRC over UDP, contact sensor on a pseudo-terminal or over
// UDP.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <atomic>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "calib/files/files.h"
#include "calib/files/input_file.h"
#include "drivers/units.h"
#include "sim/cell/physical_cell.h"
#include "sim/emulator/control.h"
#include "sim/emulator/options.h"
#include "sim/krc/cartesian_arm.h"
#include "sim/krc/eki_server.h"
#include "sim/krc/krc_udp.h"
#include "sim/mcu/mcu_thread.h"

namespace {

using namespace cellcal;

using drivers::kRadPerDeg;

/// Returns on SIGINT or SIGTERM.
void wait_for_signal() {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGTERM);
  sigaddset(&signals, SIGINT);
  int caught = 0;
  sigwait(&signals, &caught);
}

/// Executes the operator's commands until then.
template <typename Krc>
void wait_for_operator(const sim::EmulatorOptions& options, Krc& krc) {
  std::optional<sim::Control> control;
  if (!options.control.empty())
    control.emplace(options.control, [&](std::string_view line) { return sim::obey(krc, line); });
  wait_for_signal();
}

/// Common to all controllers: the physical cell with its contacts, and the contact sensor.
struct Cell {
  explicit Cell(const sim::EmulatorOptions& o, const calib::Cell& cell)
      : options(o),
        physical(sim::draw_truth(cell, o.truth)),
        sensor(sensor_of(o)),
        contacts(physical, [this](drivers::TimePoint t, bool closed) {
          sensor->edge(t, closed);
          if (wired_input) wired_input(t, closed);
        }) {
    sensor->set_faults(o.sensor_faults);
  }

  static std::unique_ptr<sim::McuThread> sensor_of(const sim::EmulatorOptions& o) {
    sim::McuOptions mcu;
    mcu.drift_ppm = o.mcu_drift_ppm;
    if (!o.udp.empty()) {
      const auto [address, port] = sim::address_of("--udp", o.udp);
      return std::make_unique<sim::McuUdp>(sim::McuUdpOptions{mcu, address, port, true});
    }
    mcu.baud = o.baud;
    return std::make_unique<sim::McuPty>(sim::McuPtyOptions{mcu, o.device_link, true});
  }
  std::string device() const {
    return options.device_link.empty() || !options.udp.empty() ? sensor->path()
                                                               : options.device_link;
  }
  /// Contacts of the controller's cycle that begins now.
  template <typename Krc>
  void follow(const Krc& krc, drivers::TimePoint now) {
    if (!options.no_spheres)
      contacts.update(now, now + krc.cycle(),
                      [&](drivers::TimePoint t) { return krc.actual_rad_at(t); });
    sensor->known_until(now + krc.cycle());
  }
  std::string contact_figures() const {
    return fmt::format("deepest {:.3f} mm, {} crashes of the shaft", contacts.deepest_m() * 1e3,
                       contacts.crashes());
  }
  int exit_code() const { return contacts.crashes() == 0 ? 0 : 1; }

  const sim::EmulatorOptions& options;
  sim::PhysicalCell physical;
  std::unique_ptr<sim::McuThread> sensor;
  sim::ContactWatch::OnEdge wired_input;  ///< of the controller; empty: not wired to the sensor
  sim::ContactWatch contacts;
};

/// Speed of a positioner for parts of some hundred kilograms [rad/s].
constexpr double kPositionerRadS = 1.5;

std::vector<double> start_of(const sim::EmulatorOptions& options, const calib::Cell& cell) {
  std::vector<double> start_rad = options.controller.start_rad;
  if (cell.robot.first_turning() > 0) {
    const calib::Joint& track = cell.robot.joints[0];
    start_rad.insert(start_rad.begin(), (track.min_rad + track.max_rad) / 2.0);
  }
  if (start_rad.size() != cell.robot.joints.size()) start_rad.assign(cell.robot.joints.size(), 0.0);
  for (const calib::PositionerAxis& axis : cell.robot.positioner)
    start_rad.push_back(std::clamp(0.0, axis.min_rad, axis.max_rad));
  return start_rad;
}

/// The cell with the tool that the controller's program sets: $NULLFRAME is the flange. Without a
/// program it is the cell file's.
calib::Cell with_tool_of(const std::string& program, calib::Cell cell) {
  if (program.find("$TOOL=$NULLFRAME") != std::string::npos)
    cell.tool.tcp = Eigen::Isometry3d::Identity();
  return cell;
}

/// Model of the arm in the packets; null: the nominal one.
std::shared_ptr<const sim::CartesianArm> stated_arm(const sim::EmulatorOptions& options,
                                                    const sim::Truth& truth, calib::Cell cell) {
  if (!options.absolute_accuracy && options.stated_robot.empty() && options.stated_tool_mm.empty())
    return nullptr;
  if (options.absolute_accuracy) cell.robot = sim::measured_robot(truth);
  if (!options.stated_robot.empty()) cell.robot = calib::load_named_robot(options.stated_robot);
  if (const auto& mm = options.stated_tool_mm; !mm.empty())
    cell.tool.tcp.translation() = Eigen::Vector3d(mm[0], mm[1], mm[2]) / drivers::kMmPerM;
  return sim::make_cartesian_arm(cell);
}

int run_rsi(const sim::EmulatorOptions& options, const calib::Cell& cell) {
  std::atomic<bool> free{false};  // the opto output, connected to the controller's input
  Cell emulated(options, cell);
  sim::ControllerConfig controller = options.controller;
  for (const calib::Joint& joint : cell.robot.joints) {
    controller.max_speed_rad_s.push_back(joint.max_speed_rad_s);
    controller.soft_min_rad.push_back(joint.min_rad);
    controller.soft_max_rad.push_back(joint.max_rad);
  }
  for (const calib::PositionerAxis& axis : cell.robot.positioner) {
    controller.max_speed_rad_s.push_back(kPositionerRadS);
    controller.soft_min_rad.push_back(axis.min_rad);
    controller.soft_max_rad.push_back(axis.max_rad);
  }
  if (options.max_acceleration_deg_s2 > 0.0)
    controller.max_acceleration_rad_s2.assign(controller.max_speed_rad_s.size(),
                                              options.max_acceleration_deg_s2 * kRadPerDeg);
  // The context's program is in the same folder.
  const std::filesystem::path program =
      std::filesystem::path(options.rsi_context).replace_filename("cellcal_rsi.src");
  if (!options.rsi_context.empty() && std::filesystem::exists(program))
    controller.program = calib::read_file(program.string());
  controller.start_rad = start_of(options, cell);
  controller.linear_unit = cell.robot.first_turning() > 0;
  const calib::Cell known = with_tool_of(controller.program, cell);
  controller.arm = sim::make_cartesian_arm(known);
  controller.states = stated_arm(options, emulated.physical.truth(), known);
  emulated.sensor->on_output([&free](drivers::TimePoint, bool is) { free = is; });
  sim::KrcUdpOptions udp;
  udp.pc_address = options.pc_address;
  udp.pc_port = options.pc_port;
  udp.restart_after_s = options.restart_after_s;
  udp.realtime = true;
  sim::KrcUdp krc(controller, udp, [&](sim::Controller& c, drivers::TimePoint now) {
    c.input(now, free);
    emulated.follow(c, now);
  });
  krc.start();
  fmt::print("emulator: {} axes, controller sends to {}:{}, contact sensor on {}\n",
             cell.robot.joints.size(), options.pc_address, options.pc_port, emulated.device());
  std::fflush(stdout);
  wait_for_operator(options, krc);
  krc.stop();
  const sim::KrcUdp::ReplyTimes times = krc.reply_times();
  fmt::print(
      "emulator: packet to reply {:.3f} ms (median), {:.3f} (p99), {:.3f} (worst) of {}; {} "
      "packets "
      "sent late by the emulator itself{}\n",
      times.median_ms, times.p99_ms, times.worst_ms, times.replies, krc.overruns(),
      krc.realtime_granted() ? "" : " (no real-time priority)");
  krc.with([&](sim::Controller& c) {
    fmt::print("emulator: {} replies taken over RSI, {} were late, {}{}\n", c.taken_ever(),
               c.late_ever(), emulated.contact_figures(),
               c.message().empty() ? "" : ", pendant: " + c.message());
  });
  return emulated.exit_code();
}

/// Channel files and clients of other software.
int run_eki_stream(const sim::EmulatorOptions& options, const calib::Cell& cell) {
  if (!options.control.empty())
    throw std::invalid_argument("--control has no effect on channel files of others: leave it out");
  refuse_external_axes(cell.robot, "the emulation of other channel files",
                       "Take a robot file without it, or the files of 'cellcal kuka-files'");
  sim::EkiStreamConfig controller;
  for (const std::string& path : options.eki_xml)
    controller.channel_xml.push_back(calib::read_file(path));
  controller.start_rad = start_of(options, cell);
  for (const calib::Joint& joint : cell.robot.joints) {
    controller.max_speed_rad_s.push_back(joint.max_speed_rad_s);
    controller.min_rad.push_back(joint.min_rad);
    controller.max_rad.push_back(joint.max_rad);
  }
  controller.lag_s = options.controller.lag_s;
  controller.arm = sim::make_cartesian_arm(cell);

  Cell emulated(options, cell);
  sim::EkiStreamServerOptions server;
  if (!options.listen.empty()) server.address = options.listen;
  server.realtime = true;
  sim::EkiStreamServer krc(controller, server, [&](sim::EkiStream& c, drivers::TimePoint now) {
    emulated.follow(c, now);
  });
  krc.start();
  for (std::size_t i = 0; i < options.eki_xml.size(); ++i)
    fmt::print("emulator: {} served on {}:{}\n", options.eki_xml[i], server.address, krc.port(i));
  fmt::print("emulator: {} axes, contact sensor on {}\n", cell.robot.joints.size(),
             emulated.device());
  std::fflush(stdout);
  wait_for_signal();
  krc.stop();
  krc.with([&](sim::EkiStream& c) {
    fmt::print("emulator: {} moves, {}{}\n", c.moves(), emulated.contact_figures(),
               c.message().empty() ? "" : ", last command left out: " + c.message());
  });
  return emulated.exit_code();
}

int run_eki(const sim::EmulatorOptions& options, const calib::Cell& cell) {
  if (options.eki_xml.empty())
    throw std::invalid_argument(
        "--wire eki needs --eki-xml: the channel file that 'cellcal kuka-files' writes");
  const std::string xml = calib::read_file(options.eki_xml.front());
  if (options.eki_xml.size() > 1 || !sim::is_cellcal_channel(sim::EkiChannelConfig::parse(xml)))
    return run_eki_stream(options, cell);
  sim::EkiControllerConfig controller;
  // The channel's KRL is in the same folder.
  const std::filesystem::path channel = options.eki_xml.front();
  controller.files[channel.filename().string()] = xml;
  for (const char* name :
       {"cellcal_eki.src", "cellcal_eki.dat", "cellcal_sub.sub", "cellcal_loop.sub"})
    controller.files[name] = calib::read_file((channel.parent_path() / name).string());
  controller.start_rad = start_of(options, cell);
  controller.linear_unit = cell.robot.first_turning() > 0;
  const calib::Cell known = with_tool_of(controller.files["cellcal_eki.src"], cell);
  controller.arm = sim::make_cartesian_arm(known);
  for (const calib::Joint& joint : cell.robot.joints)
    controller.max_speed_rad_s.push_back(joint.max_speed_rad_s);
  controller.max_speed_rad_s.resize(controller.start_rad.size(), kPositionerRadS);
  controller.lag_s = options.controller.lag_s;
  controller.noise_sigma_deg = options.controller.noise_sigma_deg;
  controller.seed = options.controller.seed;
  // A commissioned controller has the cell file's tool, measured approximately.
  const calib::FrameMmDeg tool = calib::to_frame(cell.tool.tcp);
  std::copy(tool.xyz_mm.begin(), tool.xyz_mm.end(), controller.tool_data[0].begin());
  std::copy(tool.abc_deg.begin(), tool.abc_deg.end(), controller.tool_data[0].begin() + 3);

  Cell emulated(options, cell);
  controller.states = stated_arm(options, emulated.physical.truth(), known);
  sim::EkiController* running = nullptr;
  emulated.wired_input = [&](drivers::TimePoint t, bool closed) { running->input(t, closed); };
  sim::EkiServerOptions tcp;
  if (!options.listen.empty()) tcp.address = options.listen;
  tcp.realtime = true;
  sim::EkiServer krc(controller, tcp, [&](sim::EkiController& c, drivers::TimePoint now) {
    running = &c;
    emulated.follow(c, now);
  });
  krc.start();
  fmt::print("emulator: {} axes, controller listens on {}:{}, contact sensor on {}\n",
             cell.robot.joints.size(), tcp.address, krc.port(), emulated.device());
  std::fflush(stdout);
  wait_for_operator(options, krc);
  krc.stop();
  krc.with([&](sim::EkiController& c) {
    fmt::print("emulator: {} moves, {} frames set, {} clients refused, {}\n", c.moves(),
               c.frames_set(), krc.refused_clients(), emulated.contact_figures());
  });
  return emulated.exit_code();
}

int run(const sim::EmulatorOptions& options) {
  const calib::Cell cell = calib::load_cell(options.cell);
  for (const calib::Joint& joint : cell.robot.joints)
    if (!(joint.max_speed_rad_s > 0.0))
      throw std::invalid_argument("robot file of " + cell.robot.name + ": joint " + joint.name +
                                  " has no max_speed_deg_s; an arm that moves needs it");
  return options.wire == "eki" ? run_eki(options, cell) : run_rsi(options, cell);
}

}  // namespace

int main(int argc, char** argv) {
  // Blocked before any thread exists, so that only sigwait receives them.
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGTERM);
  sigaddset(&signals, SIGINT);
  sigprocmask(SIG_BLOCK, &signals, nullptr);
  try {
    sim::EmulatorOptions options;
    CLI::App app(
        "The emulated cell on real wires: a KUKA controller over RSI/UDP or EKI/TCP and a contact "
        "sensor on a pseudo-terminal or over UDP.\nExample: cellcal-emulator --cell cell.toml "
        "--pc 127.0.0.1:49152 --device-link /tmp/contact");
    sim::add_options(app, options);
    CLI11_PARSE(app, argc, argv);
    sim::load_rsi(options);
    return run(options);
  } catch (const std::exception& e) {
    std::fprintf(stderr, "cellcal-emulator: %s\n", e.what());
    return 1;
  }
}
