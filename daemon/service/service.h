#pragma once
// Runs one session at a time: its thread, journal entry, result files and published status.

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "calib/files/input_file.h"
#include "calib/result/drift_chart.h"
#include "daemon/journal/journal.h"
#include "daemon/runner/runner.h"
#include "daemon/service/job.h"
#include "daemon/service/status.h"

namespace cellcal::daemon {

/// Plan that a session follows; with touches chosen one by one, the current touch only. Null: none yet.
struct CurrentPlan {
  std::int64_t session = 0;
  std::size_t first = 0;  ///< number of its first touch within the session
  std::shared_ptr<const calib::Plan> plan;
};

struct TaskInputs;

struct ServiceParts {
  Journal& journal;
  std::filesystem::path state_dir;
  MakeBackend make_backend;
  SessionSettings settings;
  /// Reports to send at the end of a session; called on any thread.
  std::function<std::vector<Report>(std::int64_t session, const RecordEnd& end)> ending = {};
  /// Of the figures that vary continuously; called on any thread.
  std::function<drivers::TimePoint()> clock = std::chrono::steady_clock::now;
};

class SessionService {
 public:
  explicit SessionService(ServiceParts parts);
  ~SessionService();
  SessionService(const SessionService&) = delete;
  SessionService& operator=(const SessionService&) = delete;

  /// Begins a session; returns its number. Throws BusyError, RequestError, JournalError, calib::FileError,
  /// drivers::ConfigError, drivers::DriverError.
  std::int64_t start(const RunRequest& request);
  /// Blocks new sessions while another operation uses the devices or the journal; `words` describe it and the
  /// remedy. Waits for a try_exclusively() in progress. Throws BusyError where a session or another operation
  /// holds them.
  void hold(const std::string& words);
  void release();
  /// Runs `act` under hold(), for operations longer than a session start may wait. Throws BusyError, and
  /// whatever `act` throws.
  void alone(const char* what, const std::function<void()>& act);
  /// Runs `act` under a short hold: a session started meanwhile waits instead of being refused. Returns false
  /// without calling `act` where a session or another operation is under way.
  bool try_exclusively(const char* what, const std::function<void()>& act);
  // The next six never block, neither on the disk nor on a session being prepared.
  /// Returns false where there is nothing to abort. A session being prepared is aborted as soon as it has
  /// begun.
  bool abort(const Aborted& by = {});
  /// Number of aborts requested by a person since the daemon started.
  std::uint64_t aborts() const;
  Status status() const;
  /// Plan of the newest session since the daemon started.
  CurrentPlan plan() const;
  /// Touches that `session` has published since the daemon started, in order; kept for the newest session
  /// only.
  std::vector<std::shared_ptr<const MadeTouch>> made(std::int64_t session) const;
  /// Statuses newer than `seq`, oldest first; the history is bounded.
  std::vector<Status> since(std::uint64_t seq) const;
  /// True if the threads of the session and of its devices have progressed since the last call.
  bool alive();

  /// Settings and backend of one configuration for sessions started from now on. Both are taken atomically; a
  /// running session keeps its own.
  void use(SessionSettings settings, MakeBackend make_backend);
  /// Stops the arm, ends the session and waits for it.
  void shutdown();
  /// Publishes a change of the schedule in the status.
  void show(const ScheduleSeen& schedule);
  /// Callback after each change, on the thread that makes it. Changes of several threads call it one after
  /// the other, so that status() never goes back between its calls; it publishes nothing itself.
  void on_change(std::function<void()> notify);

  std::filesystem::path results_dir(std::int64_t session) const;
  /// Directory of backups requested over the network.
  std::filesystem::path backups_dir() const;
  /// Directory of exports that may be imported over the network.
  std::filesystem::path imports_dir() const;

 private:
  /// Waits until a new session may begin, at most `limit`. Throws BusyError where an abort is requested
  /// meanwhile.
  void wait_for_room(std::unique_lock<std::mutex>& lock, std::chrono::seconds limit,
                     const std::function<bool()>& room);
  std::int64_t begin(const RunRequest& request);
  void run(Job& job);
  void carry_out(Job& job);
  /// None: nothing published, or unusable. Never throws for a damaged calibration.
  std::optional<calib::DriftChart> checks_of(const std::string& cell);
  TaskInputs task_inputs(Job& job);
  void publish(const State& state, const std::vector<calib::Touch>& touches, Job& job);
  void publish_work(const calib::WorkDone& done);
  /// Publishes the newest status, changed by `change` unless that returns false.
  void publish_changed(const std::function<bool(Status&)>& change);
  void keep_links(LinkReport report);
  /// The newest status with its continuously varying figures as of `now`; under the mutex.
  Status newest(drivers::TimePoint now) const;
  void notify();

  ServiceParts parts_;
  std::deque<calib::Withheld> no_inputs_;  ///< for the journal's files
  std::mutex notifying_;                   ///< locked before mutex_
  mutable std::mutex mutex_;
  std::condition_variable idle_;
  std::deque<Status> history_;      ///< newest last; never empty
  drivers::TimePoint published_{};  ///< time of the newest status
  std::function<void()> notify_;
  std::shared_ptr<const LinkReport> links_;
  ArmWatch arm_;
  std::vector<std::shared_ptr<const MadeTouch>> made_;  ///< of the newest session
  CurrentPlan plan_;
  Runner* runner_ = nullptr;
  bool busy_ = false, starting_ = false, ending_ = false;
  std::optional<Aborted> abort_early_;  ///< before the runner has begun
  std::string held_;                    ///< why no session may begin; empty: one may
  bool briefly_ = false;                ///< released within seconds
  std::uint64_t aborts_ = 0;
  std::uint64_t stops_ = 0;  ///< aborts of any origin
  int waiting_ = 0;  ///< starts that wait until the previous session has released its devices
  std::thread thread_;
};

}  // namespace cellcal::daemon
