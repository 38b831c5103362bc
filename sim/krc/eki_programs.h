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
  void watch_dead_man(TimePoint now);
  void watch_connection(TimePoint now);
  std::vector<double> noisy(std::vector<double> rad);
  void send_state(TimePoint now);

  // ---- the robot program -----------------------------------------------------------------------

  bool is_ready() const { return program_runs && drives_on && !e_stop && !stop_message; }
  bool busy() const { return ordered || phase != Phase::kIdle; }

  void finish(EkiOutcome how);
  bool outside_soft_limits() const;
  void begin_move();
  void brake(EkiOutcome how, double factor);

  /// What the safety controller does to a program in the middle of a motion.
  void abort_motion();
  void interrupts();
  void scale_speed();
  void tick(TimePoint now, bool muted, bool deaf, bool forgetful);

  /// Levels up to now, while the arm's path in the cycle that ends is still known.
  void take_edges(TimePoint now);

  enum class Phase { kIdle, kMoving, kBraking };

  EkiControllerConfig config;
  EkiChannel channel;
  EkiArm arm;
  std::size_t axes = 0;
  std::mt19937_64 random;
  std::uint64_t cycles = 0, moves = 0;

  // what the submit program knows
  std::uint32_t session = 0, heard = 0, last_id = 0, reported_id = 0, bad = 0;
  TimePoint heard_at{}, reopen_at{};
  bool was_connected = false, fresh_session = false;
  EkiOutcome outcome = EkiOutcome::kNone;

  // what the robot program does
  Phase phase = Phase::kIdle;
  Telegram order;
  bool ordered = false, guarded = false, stop_flag = false;
  EkiOutcome stop_reason = EkiOutcome::kStop, braking_for = EkiOutcome::kStop;
  double line_speed = 0.0, line_travel = 0.0;
  std::vector<double> latch;
  std::uint32_t latch_id = 0;

  // inputs and the operator
  std::deque<std::pair<TimePoint, bool>> edges;
  bool input_level = false;
  std::optional<std::vector<double>> input_edge;
  bool program_runs = false, drives_on = true, e_stop = false, stop_message = false;
  bool start_held = true;
  EkiMode mode = EkiMode::kAut;
  int override_percent = 100;
  std::uint32_t fault = 0;
};

}  // namespace cellcal::sim
