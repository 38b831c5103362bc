#pragma once
// cellcal's two programs on the emulated controller, statement by statement equivalent to the KRL
// in drivers/kuka/krl, and their shared state. Internal to EkiController.

#include <deque>
#include <optional>
#include <random>
#include <utility>
#include <vector>

#include "sim/krc/eki_arm.h"
#include "sim/krc/eki_channel.h"
#include "sim/krc/eki_controller.h"

namespace cellcal::sim {

/// In EKI's format of a REAL.
std::string krl_real(double value);

struct EkiPrograms {
  using EkiMode = drivers::EkiMode;
  using EkiOutcome = drivers::EkiOutcome;
  using TimePoint = drivers::TimePoint;

  explicit EkiPrograms(EkiControllerConfig c);

  // ---- the submit program ----------------------------------------------------------------------

  struct Telegram {
    std::uint32_t session = 0, seq = 0, id = 0;
    int type = 0, guard = 0, path = 0, percent = 0;
    double duration_s = 0.0;
    std::vector<double> target_rad;
  };

  /// One value of each element, or empty: the queues are then inconsistent and are emptied.
  std::optional<Telegram> on_telegram();
  void read_telegrams(TimePoint now, bool forgetful);
  void obey(const Telegram& t, TimePoint now, bool forgetful);
  void accept_move(const Telegram& t);
  void stop_motion();
  /// Dead man, drives, stop, start key, program: external ends of a move.
  void watch(TimePoint now);
  /// One step towards a cancelled robot program; the move counts as active until then.
  void end_program();
  void watch_connection(TimePoint now);
  void open_channel();
  /// CC_LOOK: recreates and reopens a channel deleted by the controller.
  void examine_channel();
  /// CC_TIME.
  void time_pass(TimePoint now);
  /// CC_FRAME: reads or sets one frame of $config.dat, after a period of rest.
  void attend_frame(TimePoint now);
  void on_frame_telegram(TimePoint now);
  drivers::EkiFrameDone frame_objection(TimePoint now) const;
  void send_frame();
  const std::vector<drivers::EkiFrameValues>& frames_of(drivers::EkiFrameKind kind) const {
    return kind == drivers::EkiFrameKind::kTool ? config.tool_data : config.base_data;
  }
  std::vector<double> noisy(std::vector<double> rad);
  void send_state(TimePoint now);

  // ---- the robot program -----------------------------------------------------------------------

  void finish(EkiOutcome how);
  bool outside_soft_limits() const;
  void begin_move();
  /// Path length of the TCP to the target.
  double path_m(double travel_rad) const;
  void go();
  /// BRAKE, or BRAKE F.
  void brake(EkiOutcome how, bool fast);
  void interrupts(TimePoint now);
  void scale_speed();
  /// Faults of the controller, as in EkiController.
  struct Faults {
    bool muted = false, deaf = false, forgetful = false, submit_halted = false;
  };
  void tick(TimePoint now, const Faults& faults);
  void run_submit(TimePoint now, const Faults& faults);

  /// Processes levels up to now, while the arm's path in the ending cycle is known.
  void read_input_edges(TimePoint now);

  // ---- the controller --------------------------------------------------------------------------

  /// $PRO_STATE1. A program stopped in the middle of a motion (kStop) continues it when started;
  /// CANCEL is accepted only for a stopped program.
  enum class ProgramState { kFree, kActive, kStop };

  bool manual() const { return mode == EkiMode::kT1 || mode == EkiMode::kT2; }
  ProgramState program_state() const;
  /// CELLCAL_EKI is selected, in any state.
  bool gone() const { return !ours || program == ProgramState::kFree; }
  bool is_ready() const;
  bool timer_ran_out(TimePoint now) const;

  void start(bool cellcal);
  /// CC_PART: the session has ended, and with it the program called by CELL.
  void part();
  /// CC_RUN.
  void run_program();
  /// End of CELLCAL_EKI: returns to CELL, or is deselected.
  void leave_program();
  void wait_for_session(TimePoint now);
  void stop_program();  ///< STOP, drives off, emergency stop: a ramp, and the program is stopped
  bool cancel();        ///< CANCEL; false: refused
  void settle();        ///< final state of program and motion once the arm is at rest

  /// kHeld: the program was stopped in the middle of a motion. kDropped: that motion was cancelled.
  enum class Phase { kIdle, kMoving, kBraking, kHeld, kDropped };

  EkiControllerConfig config;
  EkiChannel channel;
  EkiArm arm;
  std::size_t axes = 0;
  std::mt19937_64 random;
  std::uint64_t cycles = 0, moves = 0;

  // state of the submit program
  std::uint32_t session = 0, heard = 0, last_id = 0, reported_id = 0, bad = 0;
  TimePoint heard_at{};
  std::optional<TimePoint> reopen_at;
  int looks = 0;
  TimePoint pass_at{};
  std::int64_t pass_ms = 0;
  bool was_connected = false, fresh_session = false, ending = false;
  EkiOutcome outcome = EkiOutcome::kNone;

  // its state of frames: CC_FRAME_...
  bool has_frames = false, frame_waits = false;
  drivers::EkiFrameCommand frame_order;
  drivers::EkiFrameAnswer frame_answer;
  std::vector<double> frame_rest;
  TimePoint frame_at{};
  std::uint64_t frames_set = 0;

  // state of the robot program
  Phase phase = Phase::kIdle;
  Telegram order;
  /// CC_READY, CC_NEW and CC_BUSY.
  bool ready = false, ordered = false, busy = false;
  bool guarded = false, stop_flag = false;
  EkiOutcome stop_reason = EkiOutcome::kStop, braking_for = EkiOutcome::kStop;
  double line_speed = 0.0, line_travel = 0.0, line_acceleration = 0.0;
  double axes_acceleration = 0.0;  ///< of a PTP on this line
  std::vector<double> latch;
  std::uint32_t latch_id = 0;

  // inputs and operator
  std::deque<std::pair<TimePoint, bool>> edges;
  bool input_level = false;
  std::optional<std::vector<double>> input_edge;
  ProgramState program = ProgramState::kFree;
  bool ours = false, stopping = false, cancelling = false;
  /// CC_CALLED, CC_LEAVE; and whether CELL, which stays selected, has called it.
  bool called = false, leave = false, under_cell = false;
  bool at_end = false;  ///< started by CC_RUN, and at #P_END: to be cancelled before the next run
  std::optional<TimePoint> idle_since;
  drivers::EkiRequest request = drivers::EkiRequest::kNone;
  bool drives_on = true, e_stop = false, stop_message = false;
  bool start_held = true;
  EkiMode mode = EkiMode::kAut;
  int override_percent = 100;
  std::uint32_t fault = 0;
};

}  // namespace cellcal::sim
