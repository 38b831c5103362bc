#pragma once
// Performs the actions of step() and feeds back their results. Makes no decisions.
//
// One loop: collect an event (requests, results of moves and armings, status changes, answers of the workers,
// the phase's deadline), step, perform; without events, sleep for a millisecond of the session's clock.
// Everything except request_abort() and alive() runs on one thread, which never blocks: computations and disk
// writes are jobs of workers. After the end of the session the loop continues until all records are on disk
// or known to have failed.

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "calib/model/long_work.h"
#include "daemon/result/outcome.h"
#include "daemon/runner/backend.h"
#include "daemon/session/action.h"
#include "daemon/session/session.h"

namespace cellcal::daemon {

// Threads for computations (planning, identification, report) and for disk access. Both take up to seconds,
// while the session's thread has to monitor the arm.

class Worker {
 public:
  virtual ~Worker() = default;
  /// Runs jobs one after the other, in order. A job must not throw.
  virtual void post(std::function<void()> job) = 0;
};

/// On virtual time: the job is completed before post() returns.
class InlineWorker final : public Worker {
 public:
  void post(std::function<void()> job) override { job(); }
};

/// On the machine's clock: one thread. Destruction waits for the current job and drops the others.
class ThreadWorker final : public Worker {
 public:
  /// At low priority, computations yield to threads with deadlines but still progress under load.
  enum class Priority { kLow, kNormal };
  explicit ThreadWorker(Priority priority = Priority::kLow);
  ~ThreadWorker() override;
  ThreadWorker(const ThreadWorker&) = delete;
  ThreadWorker& operator=(const ThreadWorker&) = delete;

  void post(std::function<void()> job) override;

 private:
  void run();

  std::mutex mutex_;
  std::condition_variable wake_;
  std::deque<std::function<void()>> jobs_;
  bool ending_ = false;
  std::thread thread_;
};

/// Computations of the worker for a session. May throw; what() is shown to the operator.
struct Tasks {
  struct Planned {
    calib::Plan plan;
    std::string hash;
    calib::Progress progress{};  ///< of a session with touches chosen one by one; its plan is empty
  };
  struct Chosen {
    calib::Plan plan;  ///< the one touch, or none and the way home
    calib::Progress progress{};
    calib::Phrase stage{};                          ///< purpose of the touch
    std::optional<calib::SearchUnderWay> search{};  ///< while spheres are located
    bool not_found = false;  ///< a sphere cannot be located; the plan leads home
    std::string why{};       ///< reason of not_found, for the operator
  };
  std::function<Planned()> plan;
  /// `from`: present angles of all axes, the arm's before those of a positioner.
  std::function<calib::Plan(const calib::Plan&, const FindRoute&, const calib::JointVector& from)>
      route;
  /// Chooses the next touch from all previous ones.
  std::function<Chosen(const ChooseTouch&, const std::vector<calib::Touch>&,
                       const calib::JointVector& from)>
      choose;
  struct Assessed {
    /// |residual| of the newest touch, from the current knowledge.
    std::optional<double> residual_m;
    /// Per touch of a planned sequence.
    std::shared_ptr<const std::vector<calib::ExpectedContact>> expected{};
  };
  std::function<Assessed(const std::vector<calib::Touch>&)> assess =
      [](const std::vector<calib::Touch>&) { return Assessed{}; };
  std::function<SessionResult(const std::vector<calib::Touch>&)> identify;
  /// Writes the result's files.
  std::function<void(const SessionResult&, const std::vector<calib::Touch>&)> report;
};

/// Destination of a session's evidence; called on the disk's worker. Returns when it is on disk; throws where
/// it cannot be written.
class Recorder {
 public:
  virtual ~Recorder() = default;
  virtual void record(const RecordPlan& plan) = 0;
  virtual void record(const RecordReading& reading) = 0;
  virtual void record(const RecordTouch& touch) = 0;
  virtual void record(const RecordSearch& search) = 0;
  virtual void record(const RecordEnd& end) = 0;
  /// Throws where the recorded data are no longer in place.
  virtual void check() {}
  /// One line of the session's log; its loss is not a failure of the session.
  virtual void note(const std::string& utc, const std::string& words) = 0;
  /// Likewise; on disk with the next record.
  virtual void note(const RecordChange& change) = 0;
  virtual void note(const RecordContact& contact) = 0;
  virtual void note(const RecordCause& cause) = 0;
};

struct RunnerParts {
  Backend& backend;
  Recorder& recorder;
  Worker& worker;  ///< for computations
  Worker& disk;    ///< for records; waits for the disk
  Tasks tasks;
  /// Called after each step that changed something, with the touches on disk.
  std::function<void(const State&, const std::vector<calib::Touch>&)> on_change;
  /// Called a few times a second while the devices are open, regardless of changes.
  std::function<void(const drivers::RobotState&, const drivers::ContactStatus&)> on_sample = {};
  /// Called with the arm at rest: once referenced, and at each contact before the next move.
  std::function<void(const drivers::RobotState&)> on_rest = {};
  /// Move::speed_share of a move about to begin.
  std::function<double(const drivers::Move&, const drivers::RobotState&)> speed_share = {};
  /// Progress of the worker's job, about a hundred times.
  std::function<void(const calib::WorkDone&)> on_work = {};
};

class Runner {
 public:
  /// `state` is idle, with the policy and the data of an earlier run; `touches` are those already made.
  Runner(RunnerParts parts, State state, std::vector<calib::Touch> touches);
  ~Runner();
  Runner(const Runner&) = delete;
  Runner& operator=(const Runner&) = delete;

  /// Runs the session to its end; returns the final state. Never throws: an exception other than the failure
  /// of an action stops the arm, closes the devices and fails the session.
  State run();
  /// Thread-safe. Cancels computations of the worker immediately.
  void request_abort(const Aborted& by = {});
  /// True if the loop and the device threads have progressed since the last call. Always true on virtual
  /// time, where the loop runs the worker's jobs itself. To be called from a single thread.
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
  /// Computations can be cancelled, writes cannot.
  enum class Kind { kComputes, kWrites };
  void work(std::function<Event()> job, std::uint32_t route_id = 0, Kind kind = Kind::kComputes);
  void commit(std::function<void(Recorder&)> job, std::optional<Event> answer = {},
              const char* what = nullptr);

  RunnerParts parts_;
  State state_;
  std::vector<calib::Touch> touches_;
  std::shared_ptr<Inbox> inbox_;
  std::optional<Links> seen_;  ///< none: devices closed, or a re-evaluation is requested
  bool open_ = false;
  double sensor_late_s_ = 0.0;  ///< newest value
  drivers::TimePoint next_report_{};
  struct {
    calib::Touch touch;
    std::shared_ptr<const bool> written;  ///< set by the disk's worker; null: none
  } on_its_way_;                          ///< touch being written to disk
  std::atomic<bool> abort_requested_{false};
  std::atomic<std::optional<FailureKind>> abort_why_;  ///< of the abort requested
  std::atomic<std::uint64_t> turns_{1};
  std::uint64_t turns_seen_ = 0;
};

}  // namespace cellcal::daemon
