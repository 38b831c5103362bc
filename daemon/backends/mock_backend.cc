#include <fmt/format.h>

#include <algorithm>

#include "calib/files/files.h"
#include "calib/model/error.h"
#include "calib/plan/candidates.h"
#include "calib/plan/clearance.h"
#include "calib/plan/pool.h"
#include "daemon/backends/backends.h"
#include "daemon/backends/virtual_cell.h"
#include "daemon/config/config.h"
#include "drivers/kuka/krl/krl_files.h"

namespace cellcal::daemon {

namespace {

sim::TruthOptions truth_for(const DaemonConfig& config, const calib::Load* held = nullptr) {
  sim::TruthOptions truth;
  if (held) truth.held = *held;
  truth.seed = config.mock.seed;
  truth.geometry_scale = config.mock.geometry_scale;
  truth.deflection = config.mock.deflection;
  truth.gear_arcsec = config.mock.gear_arcsec;
  truth.wave_arcsec = config.mock.wave_arcsec;
  truth.compliance_rad_per_nm = config.mock.compliance_rad_per_nm;
  truth.play_arcsec = config.mock.play_arcsec;
  truth.tip_offset_m = config.mock.tip_offset_m;
  truth.tool_shift_m = Eigen::Map<const Eigen::Vector3d>(config.mock.tool_shift_m.data());
  truth.growth = config.mock.growth;
  truth.warm_up_s = config.mock.warm_up_s;
  truth.contacts = {config.mock.contact_noise_m, config.mock.bad_contact_share};
  truth.placement_m = config.mock.placement_m;
  return truth;
}

drivers::Duration busy_every(const DaemonConfig& config) {
  return std::chrono::duration_cast<drivers::Duration>(
      std::chrono::duration<double>(config.mock.busy_every_s));
}

/// Speed of a positioner for parts of some hundred kilograms [rad/s].
constexpr double kPositionerRadS = 1.5;

/// As configured; where the arm would meet the cell there, a clear posture instead, since an emulated arm cannot be jogged.
calib::JointVector clear_start(const calib::Cell& cell, calib::JointVector start) try {
  if (!cell.robot.positioner.empty()) return start;
  const calib::ArmModel arm = calib::planning_arm(cell);
  const calib::Clearance clearance(cell, arm);
  return clearance.clear(start) ? start : calib::resting_posture(cell.robot, clearance);
} catch (const calib::PlanError&) {
  return start;  // the session's plan names it
}

/// Common settings of the emulated controllers of both wires.
template <class Controller>
void set_arm(Controller& controller, const DaemonConfig& config, const calib::Cell& cell) {
  controller.start_rad = config.mock.start_rad;
  controller.linear_unit = cell.robot.first_turning() > 0;
  if (controller.linear_unit) {
    const calib::Joint& track = cell.robot.joints[0];
    const double middle_m = (track.min_rad + track.max_rad) / 2.0;
    controller.start_rad.insert(controller.start_rad.begin(),
                                config.mock.start_m.value_or(middle_m));
  }
  controller.start_rad.resize(cell.robot.joints.size(), 0.0);
  controller.start_rad = clear_start(cell, std::move(controller.start_rad));
  for (const calib::PositionerAxis& axis : cell.robot.positioner)
    controller.start_rad.push_back(std::clamp(0.0, axis.min_rad, axis.max_rad));
  controller.cycle_ms = config.mock.cycle_ms;
  controller.lag_s = config.mock.lag_s;
  controller.noise_sigma_deg = config.mock.joint_noise_deg;
  controller.seed = config.mock.seed;
  for (const calib::Joint& joint : cell.robot.joints) {
    controller.max_speed_rad_s.push_back(joint.max_speed_rad_s);
  }
  controller.max_speed_rad_s.resize(controller.start_rad.size(), kPositionerRadS);
}

/// Arm with the controller's own tool frame.
std::shared_ptr<const sim::CartesianArm> arm_as_the_controller_has_it(const DaemonConfig& config,
                                                                      const calib::Cell& cell) {
  calib::Cell known = cell;
  known.tool.tcp = controller_tcp(config, cell);
  return sim::make_cartesian_arm(known);
}

/// The model of the arm that the controller's packets state.
std::shared_ptr<const sim::CartesianArm> stated_arm(const DaemonConfig& config,
                                                    const calib::Cell& cell) {
  calib::Cell stated = cell;
  stated.tool.tcp = controller_tcp(config, cell);
  if (config.mock.absolute_accuracy)
    stated.robot = sim::measured_robot(sim::draw_truth(cell, truth_for(config)));
  if (!config.mock.stated_robot.empty())
    stated.robot = calib::load_named_robot(config.mock.stated_robot);
  if (!config.mock.stated_tool_m.empty())
    stated.tool.tcp.translation() =
        Eigen::Map<const Eigen::Vector3d>(config.mock.stated_tool_m.data());
  return sim::make_cartesian_arm(stated);
}

/// POSCORR as configured, and the controller's own model of its arm.
void set_space(sim::ControllerConfig& controller, const drivers::SpaceCorrection& space,
               const DaemonConfig& config, const calib::Cell& cell) {
  const bool tool = space.frame == drivers::CorrectionFrame::kTool;
  controller.cartesian_system = tool ? sim::CorrectionFrame::kTool : sim::CorrectionFrame::kBase;
  controller.cartesian_tag = space.tag;
  controller.clamp_mm = controller.monitor_mm = space.limit_mm;
  controller.clamp_turn_deg = controller.monitor_turn_deg = space.turn_limit_deg;
  controller.arm = arm_as_the_controller_has_it(config, cell);
}

/// Empty for an arm without the six axes that the program has.
std::string rsi_program(const DaemonConfig& config, const calib::Cell& cell) {
  constexpr std::size_t kAxes = 6;
  if (cell.robot.joints.size() < kAxes) return {};
  drivers::RsiFilesConfig files = rsi_files_for(config, cell);
  files.pc_address = "10.0.0.5";
  return drivers::rsi_files(files).at("cellcal_rsi.src");
}

VirtualCellOptions rsi_options(const DaemonConfig& config, const calib::Cell& cell,
                               const calib::Load* held) {
  VirtualCellOptions options;
  options.busy_every = busy_every(config);
  options.truth = truth_for(config, held);
  set_arm(options.controller, config, cell);
  options.controller.clamp_deg = config.rsi.correction_limit_deg.at(0);
  options.controller.monitor_deg = config.rsi.correction_limit_deg.at(0);
  options.rsi = rsi_config_for(config, cell);
  for (const drivers::AxisRange& range : rsi_files_for(config, cell).external)
    options.controller.clamp_external.push_back(drivers::travel_limit(range));
  options.controller.monitor_external = options.controller.clamp_external;
  options.controller.program = rsi_program(config, cell);
  const bool relative = options.rsi.mode == drivers::CorrectionMode::kRelative;
  options.controller.mode = relative ? sim::RsiMode::kRelative : sim::RsiMode::kAbsolute;
  options.controller.hold_on = options.rsi.hold_on;
  static_cast<drivers::RsiNames&>(options.controller) = options.rsi;
  options.controller.states = stated_arm(config, cell);
  if (options.rsi.space.on) set_space(options.controller, options.rsi.space, config, cell);
  return options;
}

VirtualEkiCellOptions eki_options(const DaemonConfig& config, const calib::Cell& cell,
                                  const calib::Load* held) {
  VirtualEkiCellOptions options;
  options.busy_every = busy_every(config);
  options.truth = truth_for(config, held);
  set_arm(options.controller, config, cell);
  // EKI's programs poll their interrupts every 12 ms, whatever RSI's cycle would be.
  options.controller.cycle_ms = 4;
  options.controller.max_acceleration_rad_s2 = config.motion.acceleration_rad_s2;
  options.eki = eki_config_for(config, cell);
  options.controller.arm = arm_as_the_controller_has_it(config, cell);
  options.controller.states = stated_arm(config, cell);
  options.controller.files = drivers::eki_files(config.controller);
  // External axes of the controller that no joint of the robot file is.
  options.controller.start_rad.resize(options.eki.wire_axes(), 0.0);
  options.controller.max_speed_rad_s.resize(options.eki.wire_axes(), 1.0);
  return options;
}

template <class VirtualCell>
class MockBackend final : public Backend {
 public:
  template <class Options>
  MockBackend(const DaemonConfig& config, const calib::Cell& cell, Options options,
              calib::Passable passable = {}, std::optional<double> axis_reach_rad = {})
      : cell_(cell, std::move(options)),
        frames_(daemon::stated_frames(config, cell)),
        wall_clock_(config.mock.wall_clock),
        passable_(std::move(passable)),
        axis_reach_rad_(axis_reach_rad) {}

  drivers::Robot& robot() override { return cell_.robot(); }
  drivers::ContactSensor& contact() override { return cell_.contact(); }
  drivers::Clock& clock() override { return cell_; }
  bool virtual_time() const override { return true; }
  bool emulated() const override { return true; }
  calib::Passable passable() override { return passable_; }
  std::optional<double> axis_reach_rad() override { return axis_reach_rad_; }
  calib::StatedFrames stated_frames() override { return frames_; }
  /// Counts from a fixed date, so that the same seed gives the same files, unless real dates are requested.
  std::string utc_now() override {
    if (wall_clock_) return wall_clock_utc();
    const auto ms = std::chrono::duration_cast<std::chrono::milliseconds>(cell_.elapsed()).count();
    return fmt::format("2000-01-{:02}T{:02}:{:02}:{:02}.{:03}Z", 1 + ms / 86'400'000 % 28,
                       ms / 3'600'000 % 24, ms / 60'000 % 60, ms / 1000 % 60, ms % 1000);
  }

 private:
  VirtualCell cell_;
  calib::StatedFrames frames_;
  bool wall_clock_;
  calib::Passable passable_;
  std::optional<double> axis_reach_rad_;
};

}  // namespace

std::unique_ptr<Backend> make_mock_backend(const DaemonConfig& config, const calib::Cell& cell,
                                           const std::string& load) {
  const calib::ArmModel arm(cell);
  const calib::Load* held = arm.load(load);
  if (wire_of(config) == WireKind::kEki)
    return std::make_unique<MockBackend<VirtualEkiCell>>(config, cell,
                                                         eki_options(config, cell, held));
  VirtualCellOptions options = rsi_options(config, cell, held);
  calib::Passable passable = passable_in_space(options.rsi.space);
  return std::make_unique<MockBackend<VirtualCell>>(
      config, cell, std::move(options), std::move(passable), correction_limit_rad(config));
}

}  // namespace cellcal::daemon
