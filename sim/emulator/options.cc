#include "sim/emulator/options.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <charconv>
#include <limits>
#include <stdexcept>
#include <tuple>

#include "calib/files/input_file.h"
#include "drivers/kuka/wire/xml_values.h"
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

void add_bounded(CLI::App& app, const char* name, double& value, double low, double high,
                 const char* words) {
  app.add_option(name, value, words)->capture_default_str()->check(within(low, high));
}

/// In the unit of its name; default 0.
void add_scaled(CLI::App& app, const char* name, double& value, double unit, double most,
                const char* words) {
  app.add_option_function<double>(
         name, [&value, unit](double given) { value = given * unit; }, words)
      ->default_str("0")
      ->check(within(0.0, most));
}

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
  add_bounded(app, "--joint-noise-deg", options.controller.noise_sigma_deg, 0.0, 1.0,
              "1 sigma of the reported axis angles");
  app.add_option("--noise-seed", options.controller.seed, "Seed of that noise")
      ->capture_default_str();
  CLI::Option* accurate = app.add_flag(
      "--absolute-accuracy", options.absolute_accuracy,
      "The controller's RIst or $POS_ACT is of the true arm: absolute accuracy is active");
  app.add_option("--stated-robot", options.stated_robot,
                 "The controller's RIst or $POS_ACT is of this robot file: another robot type")
      ->excludes(accurate);
  app.add_option("--stated-tool-mm", options.stated_tool_mm, "Likewise of this $TOOL, X Y Z")
      ->expected(3);
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
  add_bounded(app, "--mcu-drift-ppm", options.mcu_drift_ppm, -1000.0, 1000.0,
              "Of the sensor's clock");
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

void load_channel(const std::string& path, EmulatorOptions& options) {
  try {
    options.controller.channel = RsiChannelConfig::parse(calib::read_file(path));
  } catch (const std::invalid_argument& e) {
    throw CLI::ValidationError("--rsi-xml", path + ": " + e.what());
  }
  options.rsi_xml = path;
  if (!options.pc_port_given) options.pc_port = options.controller.channel->port;
}

using drivers::RsiChannelFile;
using drivers::RsiContextFile;
using drivers::RsiElement;
using drivers::RsiObject;

constexpr std::size_t kAxes = 6;

/// Inputs of AXISCORR or POSCORR, in order.
std::string value_name(bool space, std::size_t i) {
  return space ? "." + std::string(drivers::wire::kFrameNames.substr(i, 1))
               : ".A" + std::to_string(i + 1);
}

/// Channels of the axes A1 to A6, or of X to C, in order.
std::vector<int> value_channels(const RsiChannelFile& file, bool space) {
  std::vector<int> channels;
  for (const RsiElement& one : file.receive) {
    const std::size_t dot = one.tag.find('.');
    if (dot == std::string::npos || one.index == 0) continue;
    const std::string value = one.tag.substr(dot);
    const bool meant = space ? value.size() == 2 : value.starts_with(".A") && value.size() == 3;
    if (!meant) continue;
    if (channels.size() < kAxes && value == value_name(space, channels.size())) {
      channels.push_back(one.index);
      continue;
    }
    throw std::invalid_argument(fmt::format("{}:{}: {}: values in another order are not emulated",
                                            file.name, one.line, one.tag));
  }
  if (channels.size() != kAxes) {
    throw std::invalid_argument(file.name + (space
                                                 ? ": RECEIVE holds no TAG.X to TAG.C"
                                                 : ": RECEIVE holds no six axes TAG.A1 to TAG.A6"));
  }
  return channels;
}

double number(const RsiObject& object, const std::string& name, double usual) {
  const drivers::RsiParameter* found = object.parameter(name);
  double value = usual;
  if (found != nullptr && !drivers::wire::parse_number(found->value, value)) {
    throw std::invalid_argument(fmt::format("RSI: {} of {} is not a number", name, object.id));
  }
  return value;
}

/// The program's call that loads the context.
const char* load_call(const RsiContextFile& context) {
  return context.rsi_version == 6 ? "RSI_LOAD" : "RSI_CREATE";
}

/// In the pendant's wording.
void check_index(const RsiChannelFile& channel, const RsiContextFile& context,
                 const drivers::RsiInput& input) {
  const bool known = std::any_of(channel.receive.begin(), channel.receive.end(),
                                 [&](const RsiElement& e) { return e.index == input.from_index; });
  if (known) return;
  throw std::invalid_argument(fmt::format(
      "{}: Invalid index - signal output ({}:{}: {} output {}, which {} does not have)",
      load_call(context), context.name, input.line, input.from, input.from_index, channel.name));
}

void apply_axis_limits(const RsiContextFile& context, const RsiObject& corrector,
                       ControllerConfig& controller) {
  controller.clamp_deg = controller.monitor_deg = std::numeric_limits<double>::infinity();
  const RsiObject* monitor = context.only("AXISCORRMON");
  for (std::size_t i = 1; i <= kAxes; ++i) {
    const double low = number(corrector, fmt::format("LowerLimA{}", i), -drivers::kRsiClamp);
    const double high = number(corrector, fmt::format("UpperLimA{}", i), drivers::kRsiClamp);
    controller.clamp_deg = std::min({controller.clamp_deg, -low, high});
    controller.monitor_deg = std::min(
        controller.monitor_deg,
        monitor == nullptr ? drivers::kRsiMonitor
                           : number(*monitor, fmt::format("MaxA{}", i), drivers::kRsiMonitor));
  }
}

/// The channel of a correction has to be that of the external axis (from 1) that it is wired to.
void check_external(const RsiContextFile& context, const RsiChannelFile& channel,
                    const RsiObject& corrector, const drivers::RsiInput& input, int axis) {
  check_index(channel, context, input);
  const std::string name = fmt::format(".E{}", axis);
  const bool own = std::ranges::any_of(channel.receive, [&](const RsiElement& one) {
    return one.index == input.from_index && one.tag.ends_with(name);
  });
  if (!own)
    throw std::invalid_argument(
        fmt::format("{}:{}: {} takes another value's channel, which is not emulated", context.name,
                    input.line, corrector.id));
}

/// AXISCORREXT; an external axis that it does not drive is not corrected.
void apply_travel_limits(const RsiContextFile& context, const RsiChannelFile& channel,
                         ControllerConfig& controller) {
  using drivers::kMostExternal;
  controller.clamp_external.assign(kMostExternal, 0.0);
  controller.monitor_external.assign(kMostExternal, drivers::kRsiMonitor);
  const RsiObject* corrector = context.only("AXISCORREXT");
  if (corrector == nullptr) return;
  const RsiObject* monitor = context.only("AXISCORRMON");
  bool wired = false;
  for (int i = 0; i < kMostExternal; ++i) {
    const drivers::RsiInput* input =
        corrector->input((context.rsi_version == 3 ? drivers::kRsi3ExternalInput : 1) + i);
    if (input == nullptr) continue;
    wired = true;
    check_external(context, channel, *corrector, *input, i + 1);
    const auto axis = static_cast<std::size_t>(i);
    controller.clamp_external[axis] =
        std::min(-number(*corrector, fmt::format("LowerLimE{}", i + 1), -drivers::kRsiClamp),
                 number(*corrector, fmt::format("UpperLimE{}", i + 1), drivers::kRsiClamp));
    if (monitor != nullptr)
      controller.monitor_external[axis] =
          number(*monitor, fmt::format("MaxE{}", i + 1), drivers::kRsiMonitor);
  }
  if (!wired)
    throw std::invalid_argument(
        fmt::format("{}: {}: no external axis is wired", context.name, corrector->id));
}

void apply_space_limits(const RsiContextFile& context, const RsiObject& corrector,
                        ControllerConfig& controller) {
  controller.clamp_mm = std::numeric_limits<double>::infinity();
  for (const char axis : {'X', 'Y', 'Z'}) {
    const double low = number(corrector, fmt::format("LowerLim{}", axis), -drivers::kRsiClamp);
    const double high = number(corrector, fmt::format("UpperLim{}", axis), drivers::kRsiClamp);
    controller.clamp_mm = std::min({controller.clamp_mm, -low, high});
  }
  controller.clamp_turn_deg = number(corrector, "MaxRotAngle", drivers::kRsiClamp);
  const int frame = static_cast<int>(number(corrector, "RefCorrSys", 1));
  constexpr int kTool = 3;
  if (frame < 0 || frame > kTool) {
    throw std::invalid_argument(
        fmt::format("{}: RefCorrSys {} is not emulated", context.name, frame));
  }
  controller.cartesian_system = frame == kTool ? CorrectionFrame::kTool : CorrectionFrame::kBase;
  const RsiObject* monitor = context.only("POSCORRMON");
  controller.monitor_mm = monitor == nullptr ? drivers::kRsiMonitor
                                             : number(*monitor, "MaxTrans", drivers::kRsiMonitor);
  controller.monitor_turn_deg = monitor == nullptr
                                    ? drivers::kRsiMonitor
                                    : number(*monitor, "MaxRotAngle", drivers::kRsiMonitor);
}

/// INDX of the element NAME or NAME.ATTRIBUTE; 0: internal, or none.
int channel_of(const std::vector<RsiElement>& elements, const std::string& name,
               const std::string& attribute) {
  const auto found = std::ranges::find(elements, attribute.empty() ? name : name + "." + attribute,
                                       &RsiElement::tag);
  return found == elements.end() ? 0 : found->index;
}

/// Source of an input of the ETHERNET object; other objects than these are not emulated.
RsiSentValue::Of source_of(const RsiContextFile& context, const drivers::RsiInput* input) {
  using Of = RsiSentValue::Of;
  constexpr double kModeOp = 5;
  for (const RsiObject& one : context.objects) {
    if (input == nullptr || one.id != input->from) continue;
    const auto is = [&](const char* type) { return drivers::wire::same_name(one.type, type); };
    if (is("STATUS") && number(one, "Type", kModeOp) == kModeOp) return Of::kMode;
    if (is("OV_PRO")) return Of::kOverride;
    if (is("DIGIN")) return Of::kInput;
  }
  return Of::kConstant;
}

/// The context's wires replace what `channel` concludes from names.
void apply_wires(const RsiContextFile& context, const RsiChannelFile& file,
                 const RsiObject& ethernet, RsiChannelConfig& channel) {
  for (RsiSent& sent : channel.send)
    for (RsiSentValue& value : sent.values)
      if (const int index = channel_of(file.send, sent.name, value.name); index > 0)
        value.of = source_of(context, ethernet.input(index));
  const RsiObject* stop = context.only("STOP");
  const drivers::RsiInput* from = stop == nullptr ? nullptr : stop->input(1);
  for (RsiReceived& value : channel.receive) {
    if (value.role == RsiRole::kStop) value.role = RsiRole::kOther;
    if (from != nullptr && from->from == ethernet.id &&
        from->from_index == channel_of(file.receive, value.element, value.attribute))
      value.role = RsiRole::kStop;
  }
}

RsiStop stop_mode_of(const RsiContextFile& context, const RsiObject& stop) {
  const drivers::RsiParameter* named = stop.parameter("Mode");
  if (named != nullptr && named->value == "ExitMoveCorr") return RsiStop::kExitMoveCorr;
  const double mode = number(stop, "Mode", 0);
  for (const RsiStop one : {RsiStop::kInfo, RsiStop::kPathStop, RsiStop::kSpeedStop,
                            RsiStop::kFastStop, RsiStop::kExitMoveCorr})
    if (mode == static_cast<int>(one)) return one;
  throw std::invalid_argument(
      fmt::format("{}: Mode {:g} of {} is not emulated", context.name, mode, stop.id));
}

void check_release(const RsiContextFile& context, EmulatorOptions& options) {
  if (options.rsi_version == 0) options.rsi_version = context.rsi_version;
  if (drivers::rsi_format(options.rsi_version) == context.rsi_version) return;
  throw std::invalid_argument(fmt::format("{}: {}: a context of RSI {}, the controller has RSI {}",
                                          load_call(context), context.name, context.rsi_version,
                                          options.rsi_version));
}

}  // namespace

void add_truth_options(CLI::App& app, EmulatorOptions& options) {
  app.add_option("--cell", options.cell, "Cell file")->required()->check(CLI::ExistingFile);
  app.add_option("--seed", options.truth.seed, "Seed of the hidden errors")->capture_default_str();
  add_bounded(app, "--scale", options.truth.geometry_scale, 0.0, 100.0,
              "Geometric errors in units of the robot file's tolerances");
  add_bounded(app, "--deflection", options.truth.deflection, -1.0, 1.0,
              "Bending of the tool c_t [1/(N m^2)]; negative: drawn from its prior");
  app.add_option_function<double>(
         "--placement", [&options](double mm) { options.truth.placement_m = mm * 1e-3; },
         "Distance of all spheres from their places in the cell file [mm], 1 sigma; default 1")
      ->check(within(0.0, 100.0));
  add_bounded(app, "--gear-arcsec", options.truth.gear_arcsec, 0.0, 1000.0,
              "Transmission error, 1 sigma per harmonic");
  add_bounded(app, "--wave-arcsec", options.truth.wave_arcsec, 0.0, 1000.0,
              "Six waves of 5 to 35 per turn of each joint, rms, 1 sigma");
  add_bounded(app, "--compliance-sigma-rad-per-nm", options.truth.compliance_rad_per_nm, 0.0, 1e-3,
              "Compliance of each joint under its load, 1 sigma; 0: the robot file's");
  add_bounded(app, "--play-arcsec", options.truth.play_arcsec, 0.0, 1000.0,
              "Half of each joint's play, to the side of its load, 1 sigma");
  add_scaled(app, "--tip-offset-mm", options.truth.tip_offset_m, 1e-3, 10.0,
             "Deviation of the tip from the cell file [mm], at most, along each axis");
  add_scaled(app, "--growth-ppm", options.truth.growth, 1e-6, 1000.0,
             "Growth of all lengths of the arm from cold to warmed up [ppm]");
  add_bounded(app, "--warm-up-s", options.truth.warm_up_s, 1.0, 1e5,
              "Time constant of the growth, from power on [s]");
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

void add_options(CLI::App& app, EmulatorOptions& options) {
  add_truth_options(app, options);
  add_wire_options(app, options);
  add_controller_options(app, options);
  add_sensor_options(app, options);
  add_rsi_options(app, options);
}

void add_rsi_options(CLI::App& app, EmulatorOptions& options) {
  ControllerConfig& controller = options.controller;
  CLI::Option* file =
      app.add_option_function<std::string>(
             "--rsi-xml", [&options](const std::string& path) { load_channel(path, options); },
             "RSI ethernet file, cellcal's or any other: SENTYPE, elements and their order, "
             "HOLDON, and the port if --pc is not given")
          ->check(CLI::ExistingFile);
  app.add_option(
         "--rsi-context", options.rsi_context,
         "RSI's context (.rsi.xml or .rsix): release, Precision, Timeout, limits, Mode of STOP; "
         "packets then go to the file's address, too")
      ->check(CLI::ExistingFile)
      ->needs(file);
  app.add_option(
         "--rsi-version", options.rsi_version,
         "Release of the controller's RSI, 3 to 6: a context of another one is refused, and "
         "6 (iiQKA.OS2) has the cycle of 4 ms alone. Default: the context's")
      ->check(CLI::Range(3, 6));
  app.add_option("--contact-tag", controller.contact_tag,
                 "SEND element of the contact input (DIGIN); empty: none")
      ->excludes(file);
  app.add_option_function<std::string>(
         "--mode",
         [&controller](const std::string& mode) {
           controller.mode = mode == "relative" ? RsiMode::kRelative : RsiMode::kAbsolute;
         },
         "Argument of RSI_ON")
      ->default_str("absolute")
      ->check(CLI::IsMember({"absolute", "relative"}));
  app.add_flag_function(
      "--krc2",
      [&controller](std::int64_t) {
        controller.first_frame_only_ipoc = true;
        controller.cycle_ms = 12;
      },
      "As a KRC2 with RSI 2: 12 ms, and a first packet with IPOC alone");
  app.add_option("--max-acceleration-deg-s2", options.max_acceleration_deg_s2,
                 "More than this within one cycle is a 'Command gear torque' fault; 0: never. Late "
                 "replies of a busy computer can cause it")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 1e7));
  app.add_option("--control", options.control,
                 std::string("FIFO (made if missing) or \"-\" that takes the operator's commands, "
                             "one per line. ") +
                     control_help());
}

void apply_context(const RsiContextFile& context, const RsiChannelFile& channel,
                   ControllerConfig& controller) {
  const RsiObject* ethernet = context.only("ETHERNET");
  const RsiObject* corrector = context.only("AXISCORR");
  const bool space = corrector == nullptr && context.only("POSCORR") != nullptr;
  if (space) corrector = context.only("POSCORR");
  if (ethernet == nullptr || corrector == nullptr) {
    throw std::invalid_argument(context.name + ": no ETHERNET, or neither AXISCORR nor POSCORR");
  }
  const drivers::RsiParameter* named = ethernet->parameter("ConfigFile");
  if (named == nullptr || !drivers::wire::same_name(named->value, channel.name)) {
    throw std::invalid_argument(fmt::format("{}: {}: file {} not found", load_call(context),
                                            context.name, named == nullptr ? "" : named->value));
  }
  controller.precision = static_cast<int>(number(*ethernet, "Precision", drivers::kRsiPrecision));
  controller.timeout_cycles = static_cast<int>(number(*ethernet, "Timeout", drivers::kRsiTimeout));
  const std::vector<int> channels = value_channels(channel, space);
  for (std::size_t i = 0; i < kAxes; ++i) {
    const drivers::RsiInput* input = corrector->input(static_cast<int>(i) + 1);
    if (input == nullptr) {
      throw std::invalid_argument(fmt::format("{}: {} is not wired", context.name, corrector->id));
    }
    check_index(channel, context, *input);
    if (input->from_index != channels[i]) {
      throw std::invalid_argument(
          fmt::format("{}:{}: {} input {} takes another value's channel, which is not emulated",
                      context.name, input->line, corrector->id, i + 1));
    }
  }
  if (space) {
    apply_space_limits(context, *corrector, controller);
  } else {
    apply_axis_limits(context, *corrector, controller);
  }
  apply_travel_limits(context, channel, controller);
  if (const RsiObject* stop = context.only("STOP"); stop != nullptr && stop->input(1) != nullptr) {
    check_index(channel, context, *stop->input(1));
    controller.stop_mode = stop_mode_of(context, *stop);
  }
  if (controller.channel) apply_wires(context, channel, *ethernet, *controller.channel);
}

void load_rsi(EmulatorOptions& options) {
  if (!options.rsi_context.empty()) load_rsi_context(options);
  if (options.rsi_version == 6 && options.controller.cycle_ms != 4) {
    throw std::invalid_argument("RSI 6 has a cycle of 4 ms, and no other (--cycle-ms)");
  }
}

void load_rsi_context(EmulatorOptions& options) {
  const std::filesystem::path channel_path = options.rsi_xml, context_path = options.rsi_context;
  const RsiChannelFile channel =
      drivers::read_rsi_channel(calib::read_file(channel_path), channel_path.filename().string());
  if (!options.pc_port_given) {
    options.pc_address = channel.ip_number.value;
    options.pc_port = static_cast<std::uint16_t>(channel.port.value);
  }
  const RsiContextFile context =
      drivers::read_rsi_context(calib::read_file(context_path), context_path.filename().string());
  check_release(context, options);
  apply_context(context, channel, options.controller);
}

}  // namespace cellcal::sim
