#pragma once
// Options of an emulated cell, from the command line and from the RSI files that it names.

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "drivers/kuka/krl/krl_read.h"
#include "sim/cell/truth.h"
#include "sim/krc/controller.h"
#include "sim/mcu/microcontroller.h"

namespace CLI {
class App;
}

namespace cellcal::sim {

struct EmulatorOptions {
  std::filesystem::path cell;
  TruthOptions truth;
  std::string wire = "rsi";  ///< or "eki"
  ControllerConfig controller;
  bool absolute_accuracy = false;      ///< the controller computes with the true lengths and angles
  std::string stated_robot;            ///< or with another robot file; empty: the cell's
  std::vector<double> stated_tool_mm;  ///< X Y Z of another $TOOL; empty: the program's
  std::vector<std::string> eki_xml;    ///< channel files of the emulated controller
  std::string listen;                  ///< address for EKI; empty: 127.0.0.1
  std::string rsi_xml;                 ///< RSI's ethernet file; empty: cellcal's names
  std::string rsi_context;             ///< its context (.rsi.xml, .rsix); empty: none
  int rsi_version = 0;                 ///< of the controller; 0: the context's
  std::string pc_address = "127.0.0.1";
  std::uint16_t pc_port = 49152;
  bool pc_port_given = false;
  double max_acceleration_deg_s2 = 0.0;  ///< of any axis within a cycle; 0: not checked
  std::string control;                   ///< FIFO of the operator's commands; "-": standard input
  std::string device_link;
  std::string udp;  ///< ADDRESS:PORT of the sensor on Ethernet; empty: a pseudo-terminal
  int baud = 1'000'000;
  double mcu_drift_ppm = 30.0;
  std::optional<double> restart_after_s;
  McuFaults sensor_faults;  ///< from the start
  bool no_spheres = false;  ///< removed: the tip never touches anything
};

/// Parses ADDRESS:PORT. Throws CLI::ValidationError.
std::pair<std::string, std::uint16_t> address_of(const char* option, const std::string& text);
void add_truth_options(CLI::App& app, EmulatorOptions& options);
void add_options(CLI::App& app, EmulatorOptions& options);
/// Configuration of the controller's RSI, and its operator. Part of add_options.
void add_rsi_options(CLI::App& app, EmulatorOptions& options);

// RSI's signal flow context, loaded by the emulated controller as by the real one at RSI_CREATE.

/// Reads Precision, Timeout, limits, monitor, Mode of STOP and the channel's wires from `options.rsi_context` (.rsi.xml
/// or .rsix), and the packets' destination from `options.rsi_xml`, unless specified by other options.
///
/// Throws std::invalid_argument with the controller's message if the controller would refuse it,
/// and drivers::ConfigError if a file is not readable. Features of a real controller that are not
/// emulated (crossed channels) are refused as well.
void load_rsi_context(EmulatorOptions& options);

/// As above if there is a context, with the restrictions of the release: RSI 6 has no cycle of 12
/// ms.
void load_rsi(EmulatorOptions& options);

/// From parsed files. Throws as load_rsi_context().
void apply_context(const drivers::RsiContextFile& context, const drivers::RsiChannelFile& channel,
                   ControllerConfig& controller);

}  // namespace cellcal::sim
