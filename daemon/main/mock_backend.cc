#include <fmt/format.h>

#include <numbers>

#include "daemon/main/backends.h"
#include "daemon/main/virtual_cell.h"

namespace cellcal::daemon {

namespace {

VirtualCellOptions options_for(const DaemonConfig& config, const calib::Cell& cell) {
  VirtualCellOptions options;
  options.truth.seed = config.mock.seed;
  options.truth.geometry_scale = config.mock.geometry_scale;
  options.truth.deflection = config.mock.deflection;
  options.truth.gear_arcsec = config.mock.gear_arcsec;
  options.truth.placement_m = config.mock.placement_m;
  options.controller.start_rad = config.mock.start_rad;
  options.controller.start_rad.resize(cell.robot.joints.size(), 0.0);
  options.controller.cycle_ms = config.mock.cycle_ms;
  options.controller.lag_s = config.mock.lag_s;
  options.controller.noise_sigma_deg = config.mock.joint_noise_deg;
  options.controller.seed = config.mock.seed;
  options.controller.clamp_deg = config.rsi.correction_limit_deg.at(0);
  options.controller.monitor_deg = config.rsi.correction_limit_deg.at(0);
  for (const calib::Joint& joint : cell.robot.joints) {
    options.controller.max_speed_rad_s.push_back(joint.max_speed_rad_s);
  }
  options.rsi = rsi_config_for(config, cell);
  return options;
}

class MockBackend final : public Backend {
 public:
  MockBackend(const DaemonConfig& config, const calib::Cell& cell)
      : cell_(cell, options_for(config, cell)) {}

  drivers::Robot& robot() override { return cell_.robot(); }
  drivers::ContactSensor& contact() override { return cell_.contact(); }
  drivers::Clock& clock() override { return cell_; }
  bool virtual_time() const override { return true; }
  /// Counts from a fixed day, so that the same seed gives the same files.
  std::string utc_now() override {
    const auto ms = std::chrono::duration_cast<std::chrono::milliseconds>(cell_.elapsed()).count();
    return fmt::format("2000-01-{:02}T{:02}:{:02}:{:02}.{:03}Z", 1 + ms / 86'400'000 % 28,
                       ms / 3'600'000 % 24, ms / 60'000 % 60, ms / 1000 % 60, ms % 1000);
  }

 private:
  VirtualCell cell_;
};

}  // namespace

std::unique_ptr<Backend> make_mock_backend(const DaemonConfig& config, const calib::Cell& cell) {
  return std::make_unique<MockBackend>(config, cell);
}

}  // namespace cellcal::daemon
