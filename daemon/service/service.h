#pragma once
// One session at a time: its thread, its journal entry, its files, and what others see of it.

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
#include "daemon/journal/journal.h"
#include "daemon/runner/runner.h"
#include "daemon/service/arm_watch.h"
#include "daemon/service/request.h"
#include "daemon/service/settings.h"
#include "daemon/service/status.h"

namespace cellcal::daemon {

/// The plan that a session follows; of touches chosen one by one the one in hand. Null: none yet.
struct PlanInHand {
  std::int64_t session = 0;
  std::size_t first = 0;  ///< number of its first touch in the session
  std::shared_ptr<const calib::Plan> plan;
};

struct Job;
struct TaskInputs;

struct ServiceParts {
  Journal& journal;
  std::filesystem::path state_dir;
  MakeBackend make_backend;
  SessionSettings settings;
  /// What others are told with a session's end; any thread.
  std::function<std::vector<Report>(std::int64_t session, const RecordEnd& end)> ending = {};
};

class SessionService {
 public:
  explicit SessionService(ServiceParts parts);
  ~SessionService();
  SessionService(const SessionService&) = delete;
  SessionService& operator=(const SessionService&) = delete;

  /// Begins a session; returns its number. Throws BusyError, RequestError, JournalError,
  /// calib::FileError, drivers::ConfigError, drivers::DriverError.
  std::int64_t start(const RunRequest& request);
  /// Keeps sessions from beginning while something else has their devices or the journal; `words` say what, and what
  /// to do. Waits for what is done briefly_alone(). Throws BusyError where a session is under way, or something else has
  /// them already.
  void hold(const std::string& words);
  void release();
  /// Does it held: it may hold the journal for longer than an arm should wait. Throws BusyError, and what `act` throws.
  void alone(const char* what, const std::function<void()>& act);
  /// Does it held for some seconds: a session that is begun meanwhile waits for it instead of being refused. False: a
  /// session is under way, or something else is; nothing was done.
  bool briefly_alone(const char* what, const std::function<void()>& act);
  // These six wait for nothing: neither for the disk nor for a session that is being prepared.
  /// False: nothing to abort. A session that is being prepared ends when it has begun.
  enum class By { kPerson, kDaemon };
  bool abort(By by = By::kPerson);
  /// How often a person has aborted, or tried to, since the daemon started.
  std::uint64_t aborts() const;
  Status status() const;
  /// Of the newest session since the daemon started.
  PlanInHand plan() const;
  /// Touches of `session` that it has published since the daemon started, in order; of the newest session alone.
  std::vector<std::shared_ptr<const MadeTouch>> made(std::int64_t session) const;
  /// Statuses newer than `seq`, oldest first; the oldest are dropped after a while.
  std::vector<Status> since(std::uint64_t seq) const;
  /// Whether the session's thread and those of its devices have gone on since the last call.
  bool alive();

  /// Both of one configuration, for sessions that begin from now on: each takes both at once, and keeps
  /// those that it began with.
  void use(SessionSettings settings, MakeBackend make_backend);
  /// Stops the arm, ends the session, waits for it.
  void shutdown();
  /// Called from the session's thread after each change.
  void on_change(std::function<void()> notify);

  std::filesystem::path results_dir(std::int64_t session) const;
  /// Where backups go that are asked for over the network.
  std::filesystem::path backups_dir() const;
  /// Where exports lie that may be imported over the network.
  std::filesystem::path imports_dir() const;

 private:
  /// Until there is room for a session that is to begin, or `limit`. Throws BusyError where somebody aborts meanwhile.
  void wait_for_room(std::unique_lock<std::mutex>& lock, std::chrono::seconds limit,
                     const std::function<bool()>& room);
  std::int64_t begin(const RunRequest& request);
  void run(Job& job);
  void carry_out(Job& job);
  TaskInputs task_inputs(Job& job);
  void publish(const State& state, const std::vector<calib::Touch>& touches, Job& job);
  void tell_work(const calib::WorkDone& done);
  void keep_links(LinkReport report);

  ServiceParts parts_;
  std::deque<calib::Withheld> no_inputs_;  ///< the journal's files
  mutable std::mutex mutex_;
  std::condition_variable idle_;
  std::deque<Status> history_;                         ///< newest last; never empty
  std::chrono::steady_clock::time_point published_{};  ///< the newest
  std::function<void()> notify_;
  std::shared_ptr<const LinkReport> links_;  ///< newest
  ArmWatch arm_;
  std::vector<std::shared_ptr<const MadeTouch>> made_;  ///< of the newest session
  PlanInHand plan_;
  Runner* runner_ = nullptr;
  bool busy_ = false, starting_ = false, ending_ = false, abort_early_ = false;
  std::string held_;      ///< why no session may begin; empty: one may
  bool briefly_ = false;  ///< it is let go within seconds
  std::uint64_t aborts_ = 0;
  std::uint64_t stops_ = 0;  ///< aborts of anybody
  int waiting_ = 0;          ///< starts that wait until the session before has let its devices go
  std::thread thread_;
};

}  // namespace cellcal::daemon
