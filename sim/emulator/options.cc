#include "sim/emulator/options.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <charconv>
#include <tuple>

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

}  // namespace cellcal::sim
