#pragma once
// A minimal cell on virtual time: one joint whose angle [rad] is the tip's travel [m], a sphere 8
// mm before the end of each search, a sensor, and their faults.

#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "daemon/runner/runner.h"

namespace cellcal::daemon::testing {

class VirtualClock final : public drivers::Clock {
 public:
  drivers::TimePoint now() const override { return now_; }
  void sleep_until(drivers::TimePoint t) override { now_ = std::max(now_, t); }

 private:
  drivers::TimePoint now_{std::chrono::hours(1)};
};

inline constexpr int kNever = 1 << 30;

/// Deviations from the normal course. Moves and armings are counted from 1; each leg between two
/// way-points counts as one.
struct Script {
  std::map<int, drivers::MoveOutcome> outcome{};  ///< this move ends like this
  std::map<int, double> late_m{};                 ///< this search meets the surface later by this
  std::map<int, double> latch_off_m{};  ///< the reported contact of this search is this far ahead
  int endless_from = kNever;            ///< moves from this one on end only by stop()
  bool ignores_stop = false;
  bool robot_never_ready = false;
  bool never_referenced = false;
  bool contact_never_ready = false;
  bool contact_closed = false;  ///< at the start; the first retreat opens it
  int refused_armings = 0;
  bool arming_unanswered = false;
  int robot_lost_at_arming = kNever;
  int sensor_fault_at_arming = kNever;
  int sensor_fault_at_self_test = kNever;
  std::string open_robot_error{}, open_contact_error{};
  int begin_throws_at = kNever;                         ///< of the moves as requested
  std::map<int, drivers::Interruption> interruption{};  ///< why this move was silent
  int lost_for_ms = 0;               ///< duration of the lost link after a silence, then not ready
  int pause_at_arming = kNever;      ///< the link pauses for lost_for_ms, the arm at rest
  bool other_session = false;        ///< the controller was restarted meanwhile
  bool late_again = false;           ///< further late replies while the links are watched
  double moved_meanwhile_rad = 0.0;  ///< moved by something else
  int told_after_ms = 0;             ///< after an unexplained silence: time until its stamps arrive
  bool sensor_silent = false;        ///< which then reveal that the sensor sent nothing
  int busy_for_ms = 0;          ///< duration of late heartbeats after each delay of this computer
  int late_at_arming = kNever;  ///< this arming is answered late, due to this computer
  bool never_back = false;
  drivers::OperatingMode mode = drivers::OperatingMode::kUnknown;
  std::optional<int> override_percent{};
};

/// State shared by the fakes.
struct World {
  Script script;
  VirtualClock clock;
  std::vector<drivers::Move> moves;  ///< each leg of each move
  std::vector<std::uint32_t> begun;  ///< their ids, in order of the requests
  double at_rad = 0.0;
  bool robot_open = false, contact_open = false, referenced = false;
  bool in_contact = false, robot_lost = false, sensor_fault = false;
  bool moving = false, stop_asked = false;
  drivers::TimePoint ends{};
  drivers::TimePoint
      proven_from{};  ///< a self-test takes some time, during which nothing is proven
  int armings = 0, stops = 0, self_tests = 0, opened = 0, references = 0, disarmings = 0;
  drivers::Interruption interrupted_by = drivers::Interruption::kNone;
  std::uint32_t interruptions = 0, session = 1;
  std::uint64_t late = 0;
  std::uint32_t sensor_late = 0, sensor_silent = 0;  ///< ContactDelivery
  drivers::TimePoint told_at = drivers::TimePoint::max(), busy_from{};
  drivers::TimePoint down_until{};
  std::optional<drivers::ArmResult> arm_answer;
  std::deque<drivers::ContactRecord> records;  ///< of contacts, until taken
};

class FakeRobot final : public drivers::Robot {
 public:
  explicit FakeRobot(World& world) : w_(world) {}
  void open() override;
  drivers::RobotState state() const override;
  void rereference() override;
  void begin(const drivers::Move& move) override;
  void stop() override;
  std::optional<drivers::MoveResult> poll() override;
  void close() override;

 private:
  drivers::MoveOutcome natural_outcome(const drivers::Move& move) const;
  void begin_leg();
  World& w_;
  std::deque<drivers::Move> legs_;  ///< remaining legs of the current move
};

class FakeContact final : public drivers::ContactSensor {
 public:
  explicit FakeContact(World& world) : w_(world) {}
  void open() override;
  drivers::ContactStatus status() const override;
  void arm(std::uint16_t arm_id, std::chrono::milliseconds lifetime) override;
  std::optional<drivers::ArmResult> poll_arm() override;
  void disarm() override;
  void self_test() override;
  std::optional<drivers::ContactRecord> next_record() override;
  void close() override;

 private:
  World& w_;
};

class FakeBackend : public Backend {
 public:
  explicit FakeBackend(Script script = {}) { world.script = std::move(script); }
  drivers::Robot& robot() override { return robot_; }
  drivers::ContactSensor& contact() override { return contact_; }
  drivers::Clock& clock() override { return world.clock; }
  bool virtual_time() const override { return true; }
  std::string utc_now() override { return "2026-01-01T00:00:00.000Z"; }
  bool emulated() const override { return is_emulated; }

  World world;
  bool is_emulated = false;

 private:
  FakeRobot robot_{world};
  FakeContact contact_{world};
};

/// Stores records; fails at the nth one (from 1).
class FakeRecorder : public Recorder {
 public:
  void record(const RecordPlan& plan) override;
  void record(const RecordReading& reading) override;
  void record(const RecordTouch& touch) override;
  void record(const RecordSearch& search) override;
  void record(const RecordEnd& end) override;
  void note(const std::string&, const std::string& words) override { notes.push_back(words); }
  void note(const RecordChange& change) override { changes.push_back(change); }
  void note(const RecordContact& contact) override { contacts.push_back(contact); }
  void note(const RecordCause&) override {}

  int fails_at = kNever;
  int fails_for = kNever;  ///< so many calls from then on
  int calls = 0;
  std::vector<RecordReading> readings;
  std::vector<RecordTouch> touches;
  std::vector<RecordSearch> searches;
  std::vector<RecordEnd> ends;
  std::vector<std::string> notes;
  std::vector<RecordChange> changes;
  std::vector<RecordContact> contacts;

 private:
  void count();
};

/// A disk that stalls: from job number `stalls_at` (from 1) on, jobs wait for release().
class HeldWorker final : public Worker {
 public:
  void post(std::function<void()> job) override {
    if (++posted < stalls_at) return job();
    waiting.push_back(std::move(job));
  }
  void release() {
    stalls_at = kNever;
    while (!waiting.empty()) {
      const auto job = std::move(waiting.front());
      waiting.pop_front();
      job();
    }
  }

  int stalls_at = kNever, posted = 0;
  std::deque<std::function<void()>> waiting;
};

/// A plan of this many touches with the one joint, two waypoints before each and two on the return.
calib::Plan line_plan(std::size_t touches);
Tasks line_tasks(std::size_t touches);

/// A whole session with fakes.
struct Session {
  explicit Session(Script script = {}, std::size_t touches = 3);

  State run();
  /// Runs, and requests an abort when this phase is entered.
  State run_and_abort_in(Phase phase);

  FakeBackend backend;
  FakeRecorder recorder;
  InlineWorker worker;
  HeldWorker disk;  ///< runs jobs immediately by default
  Tasks tasks;
  State start;
  std::vector<calib::Touch> done;
  std::vector<Phase> phases;                         ///< each change
  std::function<void(const State&, Runner&)> watch;  ///< after each step
  std::function<void(Phase)> on_phase;
};

}  // namespace cellcal::daemon::testing
