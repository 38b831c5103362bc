#pragma once
// Performs what step() wants done and feeds back what comes of it. Decides nothing.
//
// One loop: take what happened (requests, results of moves and armings, status changes, the
// workers' answers, the phase's deadline), step, perform; when nothing happened, sleep for a
// millisecond of the session's clock. Everything but request_abort() and alive() runs on one
// thread, which waits for nothing: what thinks and what writes are jobs of workers. Behind the end
// of the session the loop goes on until all that was recorded is on disk, or known not to be.

#include <atomic>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "calib/model/long_work.h"
#include "daemon/result/session_result.h"
#include "daemon/runner/backend.h"
#include "daemon/runner/worker.h"
#include "daemon/session/evidence.h"
#include "daemon/session/session.h"

namespace cellcal::daemon {

/// What the worker does for a session. May throw; what() reaches the operator.
struct Tasks {
  struct Planned {
    calib::Plan plan;
    std::string hash;
    calib::Progress progress{};  ///< of a session that chooses as it goes; its plan is empty
  };
  struct Chosen {
    calib::Plan plan;  ///< the one touch, or none and the way home
    calib::Progress progress{};
    std::string stage{};  ///< what the touch is for, in words
    std::optional<calib::SearchUnderWay> search{};  ///< while spheres are found
    bool not_found = false;  ///< a sphere cannot be found; the plan leads home
    std::string why{};       ///< of not_found, for the operator
  };
  std::function<Planned()> plan;
  std::function<calib::Plan(const calib::Plan&, std::size_t next, const calib::JointVector& from)>
      route;
  /// The next touch, by all that were made.
  std::function<Chosen(const ChooseTouch&, const std::vector<calib::Touch>&,
                       const calib::JointVector& from)>
      choose;
  struct Assessed {
    std::optional<double> residual_m;  ///< |residual| of the newest touch, by what is known so far
    /// Per touch of a plan made beforehand.
    std::shared_ptr<const std::vector<calib::ExpectedContact>> expected{};
  };
  std::function<Assessed(const std::vector<calib::Touch>&)> assess;
  std::function<SessionResult(const std::vector<calib::Touch>&)> identify;
  /// The result's files.
  std::function<void(const SessionResult&, const std::vector<calib::Touch>&)> report;
};

/// Where a session's evidence goes; called on the disk's worker. Throws when it cannot be put on
/// disk; returns when it is there.
class Recorder {
 public:
  virtual ~Recorder() = default;
  virtual void record(const RecordPlan& plan) = 0;
  virtual void record(const RecordReading& reading) = 0;
  virtual void record(const RecordTouch& touch) = 0;
  virtual void record(const RecordSearch& search) = 0;
  virtual void record(const RecordEnd& end) = 0;
  /// Throws where what was recorded is no longer where it belongs.
  virtual void check() {}
  /// One line of the session's log; a failure to write it is not the session's.
  virtual void note(const std::string& utc, const std::string& words) = 0;
  /// Likewise; on disk with what is recorded next.
  virtual void note(const RecordChange& change) = 0;
  virtual void note(const RecordContact& contact) = 0;
  virtual void note(const RecordCause& cause) = 0;
};

struct RunnerParts {
  Backend& backend;
  Recorder& recorder;
  Worker& worker;  ///< thinks
  Worker& disk;    ///< records; waits for the disk
  Tasks tasks;
  /// Called after each step that changed something, with the touches on disk.
  std::function<void(const State&, const std::vector<calib::Touch>&)> on_change;
  /// Called a few times a second while the devices are open, whether anything changed or not.
  std::function<void(const drivers::RobotState&, const drivers::ContactStatus&)> on_look = {};
  /// Move::speed_share of a move that is about to begin.
  std::function<double(const drivers::Move&, const drivers::RobotState&)> speed_share = {};
  /// How far the worker's job is, about a hundred times.
  std::function<void(const calib::WorkDone&)> on_work = {};
};

class Runner {
 public:
  /// `state` is idle, with policy and what is known of an earlier run; `touches` are those done.
  Runner(RunnerParts parts, State state, std::vector<calib::Touch> touches);
  ~Runner();
  Runner(const Runner&) = delete;
  Runner& operator=(const Runner&) = delete;

  /// Runs the session to its end; returns the final state. Throws nothing: whatever is thrown
  /// here that is no action's own failure stops the arm, closes the devices and fails the session.
  State run();
  /// From any thread. What the worker computes for the session is called off at once.
  void request_abort();
  /// Whether the loop and the devices' threads have gone on since the last call. On virtual time
  /// always: there the loop does the worker's jobs itself. From one thread, any.
  bool alive();

  const std::vector<calib::Touch>& touches() const { return touches_; }

 private:
  struct Inbox;
  struct Perform;

  void run_to_end();
  void await_disk();
  void give_up(const std::string& words);
  bool gather();
  std::optional<Event> happened();
  std::optional<Event> device_result();
  std::optional<Event> links_changed();
  void feed(Event event);
  void perform_all(const Actions& actions);
  void note_step(Phase before, const Event& event);
  void note_contacts();
  Event event(EventKind kind, std::string words = "");
  /// What is computed can be called off, what is written cannot.
  enum class Kind { kComputes, kWrites };
  void work(std::function<Event()> job, std::uint32_t route_id = 0, Kind kind = Kind::kComputes);
  void commit(std::function<void(Recorder&)> job, std::optional<Event> answer = {},
              const char* what = nullptr);

  RunnerParts parts_;
  State state_;
  std::vector<calib::Touch> touches_;
  std::shared_ptr<Inbox> inbox_;
  std::optional<Links> seen_;  ///< none: devices closed, or a fresh look is wanted
  bool open_ = false;
  double sensor_late_s_ = 0.0;  ///< as last seen
  drivers::TimePoint next_report_{};
  std::optional<calib::Touch> on_its_way_;  ///< to the disk
  std::atomic<bool> abort_requested_{false};
  std::atomic<std::uint64_t> turns_{1};
  std::uint64_t turns_seen_ = 0;
};

}  // namespace cellcal::daemon
