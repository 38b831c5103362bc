#pragma once
// cellcal's two programs on the emulated controller, statement by statement what the KRL in
// drivers/kuka/krl says, and what they share. Internal to EkiController.

#include <deque>
#include <optional>
#include <random>
#include <utility>
#include <vector>

#include "sim/krc/eki_arm.h"
#include "sim/krc/eki_channel.h"
#include "sim/krc/eki_controller.h"

namespace cellcal::sim {

/// As EKI writes a REAL.
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

  /// One value of each element, or none: then the queues are out of step and are emptied.
  std::optional<Telegram> take_telegram();
  void read_telegrams(TimePoint now, bool forgetful);
  void obey(const Telegram& t, TimePoint now, bool forgetful);
  void take_move(const Telegram& t);
  void stop_motion();
  /// Dead man, drives, stop, start key, program: what ends a move from outside.
  void watch(TimePoint now);
  /// One step towards a robot program that is cancelled; until it is, the move counts as under way.
  void end_program();
  void watch_connection(TimePoint now);
  void open_channel();
  /// CC_LOOK: a channel that the controller has deleted is made and opened anew.
  void look_at_channel();
  /// CC_TIME.
  void time_pass(TimePoint now);
  /// CC_FRAME: one frame of $config.dat, read or set, once the arm has stood for a while.
  void attend_frame(TimePoint now);
  void take_frame_telegram(TimePoint now);
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
  /// Of the TCP to the ordered target.
  double path_m(double travel_rad) const;
  void go();
  /// BRAKE, or BRAKE F.
  void brake(EkiOutcome how, bool fast);
  void interrupts(TimePoint now);
  void scale_speed();
  /// What goes wrong at the controller, as EkiController has it.
  struct Faults {
    bool muted = false, deaf = false, forgetful = false, submit_halted = false;
  };
  void tick(TimePoint now, const Faults& faults);
  void run_submit(TimePoint now, const Faults& faults);

  /// Levels up to now, while the arm's path in the cycle that ends is still known.
  void take_edges(TimePoint now);

  // ---- the controller under both ---------------------------------------------------------------

  /// $PRO_STATE1. A program that stands in the middle of a motion (kStop) goes on with it when it is
  /// started; CANCEL is taken of one that stands, and of no other.
  enum class ProgramState { kFree, kActive, kStop };

  bool manual() const { return mode == EkiMode::kT1 || mode == EkiMode::kT2; }
  ProgramState program_state() const;
  /// Selected is CELLCAL_EKI, whatever its state.
  bool gone() const { return !ours || program == ProgramState::kFree; }
  bool is_ready() const;
  bool timer_ran_out(TimePoint now) const;

  void start(bool cellcal);
  /// CC_PART: the session has ended, and with it what CELL has called.
  void part();
  /// CC_RUN.
  void run_program();
  /// CELLCAL_EKI at its end: back in CELL, or nothing is selected any more.
  void leave_program();
  void wait_for_session(TimePoint now);
  void stop_program();  ///< STOP, drives off, emergency stop: a ramp, and the program stands
  bool cancel();        ///< CANCEL; false: refused
  void settle();        ///< what becomes of program and motion once the arm is at rest

  /// kHeld: the program was stopped in the middle of a motion. kDropped: that motion was cancelled.
  enum class Phase { kIdle, kMoving, kBraking, kHeld, kDropped };

  EkiControllerConfig config;
  EkiChannel channel;
  EkiArm arm;
  std::size_t axes = 0;
  std::mt19937_64 random;
  std::uint64_t cycles = 0, moves = 0;

  // what the submit program knows
  std::uint32_t session = 0, heard = 0, last_id = 0, reported_id = 0, bad = 0;
  TimePoint heard_at{};
  std::optional<TimePoint> reopen_at;
  int looks = 0;
  TimePoint pass_at{};
  std::int64_t pass_ms = 0;
  bool was_connected = false, fresh_session = false, ending = false;
  EkiOutcome outcome = EkiOutcome::kNone;

  // what it knows of frames: CC_FRAME_...
  bool has_frames = false, frame_waits = false;
  drivers::EkiFrameCommand frame_order;
  drivers::EkiFrameAnswer frame_answer;
  std::vector<double> frame_rest;
  TimePoint frame_at{};
  std::uint64_t frames_set = 0;

  // what the robot program does
  Phase phase = Phase::kIdle;
  Telegram order;
  /// CC_READY, CC_NEW and CC_BUSY.
  bool ready = false, ordered = false, busy = false;
  bool guarded = false, stop_flag = false;
  EkiOutcome stop_reason = EkiOutcome::kStop, braking_for = EkiOutcome::kStop;
  double line_speed = 0.0, line_travel = 0.0, line_acceleration = 0.0;
  double axes_acceleration = 0.0;  ///< what PTP would have on this line
  std::vector<double> latch;
  std::uint32_t latch_id = 0;

  // inputs and the operator
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
