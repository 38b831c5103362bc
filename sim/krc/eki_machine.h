#pragma once
// Execution environment of the controller's files: robot and submit interpreter, arm, inputs, EthernetKRL's functions.
// Internal to EkiController.

#include <array>
#include <deque>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "drivers/kuka/wire/wire_axes.h"
#include "sim/krc/eki_arm.h"
#include "sim/krc/eki_channel.h"
#include "sim/krc/eki_controller.h"
#include "sim/krl/interpreter.h"

namespace cellcal::sim {

/// Inputs and outputs that the programs name: the cell is wired as they expect.
struct EkiWiring {
  int input = 1;
  bool contact_is_on = true;
  std::array<int, 4> request_output{};  ///< by ControllerRequest; 0: none
};
EkiWiring wiring_of(const EkiControllerConfig::Files& files);

struct EkiMachine final : krl::Mover {
  using OperatingMode = drivers::OperatingMode;
  using TimePoint = drivers::TimePoint;

  explicit EkiMachine(EkiControllerConfig c);

  struct Faults {
    bool muted = false, deaf = false, forgetful = false, submit_halted = false;
  };
  void tick(TimePoint at, const Faults& with);

  /// $PRO_STATE1 of the selected program.
  enum class ProgramState { kFree = 1, kActive = 3, kStop = 4, kEnd = 5 };
  bool manual() const { return mode == OperatingMode::kT1 || mode == OperatingMode::kT2; }
  ProgramState program_state() const;
  void start(const char* name);
  void stop_program();  ///< STOP, drives off, emergency stop: a ramp, and the program is stopped
  bool cancel();        ///< CANCEL; false: refused
  void settle();        ///< state of program and motion once the arm is at rest
  /// A function of the submit program without parameters; 0 before the first pass.
  int asked(const char* function);

  // ---- Mover
  void move(const krl::Motion& motion) override;
  bool moving() const override { return phase == Phase::kMoving || phase == Phase::kBraking; }
  void brake(bool fast) override;
  void drop_motion() override { phase = Phase::kIdle; }
  void go_on() override;

  // ---- motion
  std::vector<double> target_of(const krl::Motion& motion) const;
  KukaFrame frame_of(const std::vector<double>& rad) const;
  double linear_speed(const std::vector<double>& target) const;
  double path_m(const std::vector<double>& target) const;
  void go();
  void scale_speed();
  void read_input_edges();
  std::vector<double> measured();
  bool has_frames();

  // ---- system variables and external routines
  krl::Value& system(const char* name) { return program[name]; }
  int whole_or_0(const char* name) { return program.has(name) ? program[name].i : 0; }
  void set_axes(krl::Value& value, const std::vector<double>& rad) const;
  void set_external(krl::Value& position, const std::vector<double>& rad) const;
  void bind_state();
  void bind_variables();
  void bind_timers();
  void bind_channel();
  void bind_kinematics();
  void write_command(const std::string& command);
  std::int64_t timer_ms() const;
  krl::Value status(std::size_t waiting, bool failed) const;
  krl::Value take(const krl::Value& path, krl::Value& into, const char* kind);

  /// kHeld: the program was stopped in mid-motion. kBraked: an interrupt has stopped it. kDropped: cancelled.
  enum class Phase { kIdle, kMoving, kBraking, kBraked, kHeld, kDropped };

  EkiControllerConfig config;
  EkiWiring wiring;
  EkiChannel channel;
  EkiArm arm;
  krl::Program program;
  krl::Interpreter robot, submit;
  Faults faults;
  std::size_t axes = 0;
  drivers::WireAxes wire{0, false};
  std::mt19937_64 random;
  std::uint64_t cycles = 0, moves = 0, frames_set = 0;
  TimePoint now{};
  std::optional<std::vector<double>> measurement;  ///< of this cycle
  std::optional<TimePoint> reopen_at;
  struct Timer {
    bool stopped = true;
    std::int64_t value = 0, since = 0;
  };
  std::array<Timer, 64> timers{};

  Phase phase = Phase::kIdle;
  std::vector<double> target;
  double line_speed = 0.0, line_travel = 0.0, line_acceleration = 0.0;
  double axes_acceleration = 0.0;  ///< of a PTP on this line

  // inputs and operator
  std::deque<std::pair<TimePoint, bool>> edges;
  bool input_level = false, pulse = false, interrupting = false;
  std::optional<std::vector<double>> input_edge;  ///< position at the first one of a motion
  ProgramState state = ProgramState::kFree;
  std::string selected;
  bool stopping = false, cancelling = false;
  drivers::ControllerRequest request = drivers::ControllerRequest::kNone;
  bool drives_on = true, e_stop = false, stop_message = false, start_held = true;
  OperatingMode mode = OperatingMode::kAut;
  int override_percent = 100;
};

}  // namespace cellcal::sim
