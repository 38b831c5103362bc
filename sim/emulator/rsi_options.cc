#include <CLI/CLI.hpp>
#include <fstream>
#include <iterator>

#include "sim/emulator/control.h"
#include "sim/emulator/options.h"

namespace cellcal::sim {
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
