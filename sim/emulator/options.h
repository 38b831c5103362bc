#pragma once
// What an emulated cell is asked to be, from the command line.

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

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
  std::filesystem::path eki_xml;  ///< channel file of the emulated controller
  std::filesystem::path rsi_xml, rsi_context;  ///< likewise for RSI; empty: --pc and the rest
  std::string listen;             ///< address for EKI; empty: 127.0.0.1
  std::string pc_address = "127.0.0.1";
  std::uint16_t pc_port = 49152;
  std::string device_link;
  int baud = 1'000'000;
  double mcu_drift_ppm = 30.0;
  std::optional<double> restart_after_s;
  McuFaults sensor_faults;  ///< from the start
  bool no_spheres = false;  ///< taken away: the tip never touches anything
};

void add_truth_options(CLI::App& app, EmulatorOptions& options);
void add_options(CLI::App& app, EmulatorOptions& options);

}  // namespace cellcal::sim
