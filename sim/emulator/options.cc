#include "sim/emulator/options.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <charconv>
#include <fstream>
#include <iterator>
#include <tuple>

#include "sim/emulator/control.h"

namespace cellcal::sim {

namespace {

/// CLI::Range accepts text that is not a number.
CLI::Validator within(double low, double high) {
  const std::string range = fmt::format("{} to {}", low, high);
  return {[=](std::string& text) -> std::string {
            double value = 0.0;
            const bool fits =
                CLI::detail::lexical_cast(text, value) && value >= low && value <= high;
            return fits ? "" : fmt::format("\"{}\" is not a number from {}", text, range);
          },
          range};
}

/// In the unit of its name; default 0.
void add_scaled(CLI::App& app, const char* name, double& value, double unit, double most,
                const char* words) {
  app.add_option_function<double>(
         name, [&value, unit](double given) { value = given * unit; }, words)
      ->default_str("0")
      ->check(within(0.0, most));
}

}  // namespace

void add_truth_options(CLI::App& app, EmulatorOptions& options) {
  app.add_option("--cell", options.cell, "Cell file")->required()->check(CLI::ExistingFile);
  app.add_option("--seed", options.truth.seed, "Seed of the hidden errors")->capture_default_str();
  app.add_option("--scale", options.truth.geometry_scale,
                 "Geometric errors in units of the robot file's tolerances")
      ->capture_default_str()
      ->check(within(0.0, 100.0));
  app.add_option("--deflection", options.truth.deflection,
                 "Bending of the tool c_t [1/(N m^2)]; negative: drawn from its prior")
      ->capture_default_str()
      ->check(within(-1.0, 1.0));
  app.add_option_function<double>(
         "--placement", [&options](double mm) { options.truth.placement_m = mm * 1e-3; },
         "Distance of all spheres from their places in the cell file [mm], 1 sigma; default 1")
      ->check(within(0.0, 100.0));
  app.add_option("--gear-arcsec", options.truth.gear_arcsec,
                 "Transmission error, 1 sigma per harmonic")
      ->capture_default_str()
      ->check(within(0.0, 1000.0));
  app.add_option("--compliance-sigma-rad-per-nm", options.truth.compliance_rad_per_nm,
                 "Compliance of each joint under its load, 1 sigma; 0: the robot file's")
      ->capture_default_str()
      ->check(within(0.0, 1e-3));
  app.add_option("--play-arcsec", options.truth.play_arcsec,
                 "Half of each joint's play, to the side of its load, 1 sigma")
      ->capture_default_str()
      ->check(within(0.0, 1000.0));
  add_scaled(app, "--tip-offset-mm", options.truth.tip_offset_m, 1e-3, 10.0,
             "Deviation of the tip from the cell file [mm], at most, along each axis");
  add_scaled(app, "--growth-ppm", options.truth.growth, 1e-6, 1000.0,
             "Growth of all lengths of the arm from cold to warmed up [ppm]");
  app.add_option("--warm-up-s", options.truth.warm_up_s,
                 "Time constant of the growth, from power on [s]")
      ->capture_default_str()
      ->check(within(1.0, 1e5));
  add_scaled(app, "--contact-noise-mm", options.truth.contacts.noise_m, 1e-3,
             kMostContactNoiseM * 1e3, "Noise of each closing of the circuit [mm], 1 sigma");
  add_scaled(app, "--bad-contact-percent", options.truth.contacts.bad_share, 1e-2, 100.0,
             "Share of the touches with a chip of 0.3 to 1 mm between tip and sphere [%]");
}

std::pair<std::string, std::uint16_t> address_of(const char* option, const std::string& text) {
  const auto colon = text.rfind(':');
  std::uint16_t port = 0;
  const char* end = text.data() + text.size();
  const char* digits = colon == std::string::npos ? end : text.data() + colon + 1;
  const auto [stop, error] = std::from_chars(digits, end, port);
  if (error != std::errc() || stop != end || port < 1)
    throw CLI::ValidationError(option, "\"" + text + "\" is not ADDRESS:PORT");
  return {text.substr(0, colon), port};
}

namespace {

/// Protocol of the controller and its peer.
void add_wire_options(CLI::App& app, EmulatorOptions& options) {
  app.add_option_function<std::string>(
         "--pc",
         [&options](const std::string& text) {
           std::tie(options.pc_address, options.pc_port) = address_of("--pc", text);
           options.pc_port_given = true;
         },
         "Address of the daemon's RSI port, ADDRESS:PORT")
      ->default_str("127.0.0.1:49152");
  app.add_option("--wire", options.wire, "Protocol of the controller")
      ->capture_default_str()
      ->check(CLI::IsMember({"rsi", "eki"}));
  CLI::Option* xml =
      app.add_option("--eki-xml", options.eki_xml,
                     "EKI channel file as 'cellcal kuka-files' writes it: elements, limits and "
                     "port. Or one or two files of other software: served by the names of their "
                     "elements")
          ->check(CLI::ExistingFile);
  app.add_option("--listen", options.listen, "Address to listen on for EKI")
      ->default_str("127.0.0.1")
      ->needs(xml);
}

void add_controller_options(CLI::App& app, EmulatorOptions& options) {
  app.add_option("--cycle-ms", options.controller.cycle_ms, "RSI cycle")
      ->capture_default_str()
      ->check(CLI::IsMember({4, 12}));
  app.add_option(
         "--lag-ms",
         [&options](const CLI::results_t& values) {
           double ms = 0.0;
           if (!CLI::detail::lexical_cast(values.front(), ms) || !(ms >= 0.0 && ms <= 500.0))
             return false;
           options.controller.lag_s = ms / 1e3;
           return true;
         },
         "First-order lag of the arm behind its setpoint")
      ->default_str("20");
  app.add_option("--joint-noise-deg", options.controller.noise_sigma_deg,
                 "1 sigma of the reported axis angles")
      ->capture_default_str()
      ->check(within(0.0, 1.0));
  app.add_option("--noise-seed", options.controller.seed, "Seed of that noise")
      ->capture_default_str();
  app.add_option_function<double>(
         "--clamp-deg",
         [&options](double degrees) {
           options.controller.clamp_deg = degrees;
           options.controller.monitor_deg = degrees;
         },
         "Limit of the axis corrections, AXISCORR's and its monitor's")
      ->default_str("90")
      ->check(within(0.1, 720.0));
  app.add_option(
      "--restart-after", options.restart_after_s,
      "Seconds after which the emulated operator starts RSI again when it has stopped, by a "
      "fault or by STOP at the end of a session");
}

void add_sensor_options(CLI::App& app, EmulatorOptions& options) {
  app.add_option("--device-link", options.device_link,
                 "Symbolic link to the sensor's pseudo-terminal");
  app.add_option(
      "--udp", options.udp,
      "The sensor is the board on Ethernet, at ADDRESS:PORT of this computer; the daemon's "
      "[contact] device is then udp:ADDRESS:PORT");
  app.add_option("--baud", options.baud, "Of the sensor's line")->capture_default_str();
  app.add_option("--mcu-drift-ppm", options.mcu_drift_ppm, "Of the sensor's clock")
      ->capture_default_str()
      ->check(within(-1000.0, 1000.0));
  app.add_option_function<std::string>(
         "--fault",
         [&options](const std::string& fault) {
           if (fault == "wire-broken")
             options.sensor_faults.circuit.sense_wire = TouchCircuit::kOpen;
           options.sensor_faults.circuit.capture_joint_open = fault == "stuck-open";
           options.sensor_faults.silent = fault == "silent";
           options.no_spheres = fault == "no-spheres";
         },
         "Fault: the contact sensor is wire-broken (reads as contact), stuck-open (never "
         "sees one) or silent; or no-spheres are there")
      ->check(CLI::IsMember({"wire-broken", "stuck-open", "silent", "no-spheres"}));
}

}  // namespace

void add_options(CLI::App& app, EmulatorOptions& options) {
  add_truth_options(app, options);
  add_wire_options(app, options);
  add_controller_options(app, options);
  add_sensor_options(app, options);
  add_rsi_options(app, options);
}

namespace {

template <typename Value>
void add_choice(CLI::App& app, const char* name, const char* text, Value& value,
                const std::vector<std::pair<std::string, Value>>& choices) {
  std::string usual;
  for (const auto& [word, choice] : choices) {
    if (choice == value) usual = word;
  }
  app.add_option_function<std::string>(
         name,
         [&value, choices](const std::string& given) {
           for (const auto& [word, choice] : choices) {
             if (word == given) value = choice;
           }
         },
         text)
      ->default_str(usual)
      ->check([choices](const std::string& given) -> std::string {
        std::string known;
        for (const auto& [word, choice] : choices) {
          if (word == given) return {};
          known += known.empty() ? word : ", " + word;
        }
        return "\"" + given + "\" is not one of " + known;
      });
}

void load_channel(const std::string& path, EmulatorOptions& options) {
  std::ifstream file(path, std::ios::binary);
  const std::string xml{std::istreambuf_iterator<char>(file), {}};
  try {
    options.controller.channel = RsiChannelConfig::parse(xml);
  } catch (const std::invalid_argument& e) {
    throw CLI::ValidationError("--rsi-xml", path + ": " + e.what());
  }
  options.rsi_xml = path;
  if (!options.pc_port_given) options.pc_port = options.controller.channel->port;
}

void add_names(CLI::App& app, ControllerConfig& controller, CLI::Option* file) {
  const auto name = [&](const char* option, std::string& value, const char* text) {
    app.add_option(option, value, text)->capture_default_str()->excludes(file);
  };
  name("--sentype", controller.sentype, "CONFIG/SENTYPE");
  name("--axis-tag", controller.axis_tag, "Element of the axis corrections A1..A6");
  name("--external-axis-tag", controller.external_axis_tag, "Likewise E1..E6");
  name("--cartesian-tag", controller.cartesian_tag, "Likewise X Y Z A B C");
  name("--stop-tag", controller.stop_tag, "Element of the STOP object; empty: none");
  name("--mode-tag", controller.mode_tag, "SEND element of STATUS (Mode_Op); empty: none");
  name("--override-tag", controller.override_tag, "Likewise of OV_PRO");
  name("--contact-tag", controller.contact_tag, "Likewise of the contact input (DIGIN)");
  app.add_option("--hold-on", controller.hold_on, "HOLDON of all corrections, 1 or 0")
      ->default_str("1")
      ->excludes(file);
  app.add_flag_function(
         "--no-setpoint", [&controller](std::int64_t) { controller.send_setpoint = false; },
         "No DEF_ASPos")
      ->excludes(file);
  app.add_flag_function(
         "--no-delay", [&controller](std::int64_t) { controller.send_delay = false; },
         "No DEF_Delay")
      ->excludes(file);
  app.add_flag("--rsol", controller.send_cartesian_setpoint, "DEF_RSol as well")->excludes(file);
}

void add_limits(CLI::App& app, EmulatorOptions& options) {
  ControllerConfig& controller = options.controller;
  const auto limit = [&](const char* option, double& value, const char* text) {
    app.add_option(option, value, text)->capture_default_str()->check(CLI::Range(0.1, 10000.0));
  };
  limit("--monitor-deg", controller.monitor_deg, "AXISCORRMON; set it after --clamp-deg");
  limit("--clamp-mm", controller.clamp_mm, "POSCORR's limit of X, Y, Z");
  limit("--clamp-turn-deg", controller.clamp_turn_deg, "POSCORR's limit of A, B, C");
  limit("--monitor-mm", controller.monitor_mm, "POSCORRMON, shift");
  limit("--monitor-turn-deg", controller.monitor_turn_deg, "POSCORRMON, turn");
  app.add_option("--max-acceleration-deg-s2", options.max_acceleration_deg_s2,
                 "More than this within one cycle is a 'Command gear torque' fault; 0: never. Late "
                 "replies of a busy computer can cause it")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 1e7));
}

}  // namespace

void add_rsi_options(CLI::App& app, EmulatorOptions& options) {
  ControllerConfig& controller = options.controller;
  CLI::Option* file =
      app.add_option_function<std::string>(
             "--rsi-xml", [&options](const std::string& path) { load_channel(path, options); },
             "RSI ethernet file, cellcal's or any other: SENTYPE, elements and their order, "
             "HOLDON, and the port if --pc is not given")
          ->check(CLI::ExistingFile);
  app.add_option("--rsi-context", options.rsi_context,
                 "RSI's context (.rsi.xml or .rsix): release, Precision, Timeout, limits; packets "
                 "then go to the file's address, too")
      ->check(CLI::ExistingFile)
      ->needs(file);
  app.add_option(
         "--rsi-version", options.rsi_version,
         "Release of the controller's RSI, 3 to 6: a context of another one is refused, and "
         "6 (iiQKA.OS2) has the cycle of 4 ms alone. Default: the context's")
      ->check(CLI::Range(3, 6));
  add_names(app, controller, file);
  add_choice<RsiMode>(app, "--mode", "Argument of RSI_ON", controller.mode,
                      {{"absolute", RsiMode::kAbsolute}, {"relative", RsiMode::kRelative}});
  add_choice<CorrectionFrame>(app, "--correction-frame", "RefCorrSys of Cartesian corrections",
                              controller.cartesian_system,
                              {{"base", CorrectionFrame::kBase}, {"tool", CorrectionFrame::kTool}});
  add_choice<RsiStop>(app, "--stop-mode", "Mode of the STOP object", controller.stop_mode,
                      {{"0", RsiStop::kInfo},
                       {"1", RsiStop::kPathStop},
                       {"2", RsiStop::kSpeedStop},
                       {"3", RsiStop::kFastStop},
                       {"4", RsiStop::kExitMoveCorr}});
  app.add_option("--precision", controller.precision,
                 "Decimals of the packets; KUKA's default is 1")
      ->capture_default_str()
      ->check(CLI::Range(0, 12));
  app.add_option("--timeout-cycles", controller.timeout_cycles,
                 "Late replies until KSS29002, ETHERNET's Timeout")
      ->capture_default_str()
      ->check(CLI::Range(0, 1000000));
  app.add_flag("--timeout-total", controller.timeout_counts_total,
               "They count over the whole session, not in a row");
  app.add_option("--ipoc-step", controller.ipoc_step,
                 "IPOC per packet; 0: the cycle's milliseconds")
      ->capture_default_str()
      ->check(CLI::Range(0, 1000));
  app.add_flag_function(
      "--krc2",
      [&controller](std::int64_t) {
        controller.first_frame_only_ipoc = true;
        controller.cycle_ms = 12;
      },
      "As a KRC2 with RSI 2: 12 ms, and a first packet with IPOC alone");
  add_limits(app, options);
  app.add_option("--control", options.control,
                 std::string("FIFO (made if missing) or \"-\" that takes the operator's commands, "
                             "one per line. ") +
                     control_help());
}

}  // namespace cellcal::sim
