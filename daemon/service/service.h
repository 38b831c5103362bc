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
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "calib/syntax/input_file.h"
#include "daemon/journal/journal.h"
#include "daemon/runner/backend.h"
#include "daemon/runner/runner.h"
#include "daemon/service/options.h"
#include "daemon/service/status.h"

namespace cellcal::daemon {

/// A session is under way.
struct BusyError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The request cannot be carried out as it stands: wrong file, nothing to resume.
struct RequestError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

inline constexpr int kPlannedTouches = 40, kMostChosen = 200;

struct RunRequest {
  SessionKind kind = SessionKind::kCalibrate;
  std::string target;              ///< of a qualification; empty: the cell's first sphere
  /// Of a check: the session of the calibration; none: the newest that is published, of `cell` where that is given.
  std::optional<std::int64_t> calibration;
  std::filesystem::path cell;      ///< absolute; empty only when resuming or checking
  std::optional<int> fit_touches;  ///< none: kPlannedTouches, or at most kMostChosen of a goal
  int check_touches = 10;
  /// u95 in mm, mean over the region: touches are chosen one by one until it is reached.
  std::optional<double> goal_mm;
  std::string region = "workspace";
  bool find = false;  ///< spheres are found by touching first; those without a centre always are
  bool accept_change = false;  ///< publish though the arm changed since its last calibration
  unsigned seed = 1;
  bool resume = false;
  /// Who begins it where nobody is there; stands in its events. Empty: a person.
  std::string unattended;
  /// Only if nobody has aborted since SessionService::aborts() said this.
  std::optional<std::uint64_t> unless_aborted;
};

/// The plan that a session follows; of touches chosen one by one the one in hand. Null: none yet.
struct PlanInHand {
  std::int64_t session = 0;
  std::size_t first = 0;  ///< number of its first touch in the session
  std::shared_ptr<const calib::Plan> plan;
};

/// What a session takes with it when it begins.
struct SessionSettings {
  TouchPolicy touch;
  Timeouts timeouts;
  int retries = 0;               ///< harmless interruptions after which a session goes on by itself
  SearchLimits search_limits{};  ///< of today's link: a resumed session has its own touch policy
};

using MakeBackend = std::function<std::unique_ptr<Backend>(const calib::Cell&)>;

struct ServiceParts {
  Journal& journal;
  std::filesystem::path state_dir;
  MakeBackend make_backend;
  SessionSettings settings;
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
  /// to do. Throws BusyError where a session is under way, or something else has them already.
  void hold(const std::string& words);
  void release();
  /// Does it held: it may hold the journal for longer than an arm should wait. Throws BusyError, and what `act` throws.
  void alone(const char* what, const std::function<void()>& act);
  // These six wait for nothing: neither for the disk nor for a session that is being prepared.
  /// False: nothing to abort. A session that is being prepared ends when it has begun.
  enum class By { kPerson, kDaemon };
  bool abort(By by = By::kPerson);
  /// How often a person has aborted, or tried to, since the daemon started.
  std::uint64_t aborts() const;
  Status status() const;
  /// Of the newest session since the daemon started.
  PlanInHand plan() const;
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

 private:
  struct Job;
  std::unique_ptr<Job> prepare(const RunRequest& request);
  void run(Job& job);
  void carry_out(Job& job);
  void publish(const State& state, const std::vector<calib::Touch>& touches, Job& job);
  void keep_links(LinkReport report);

  ServiceParts parts_;
  std::deque<calib::Withheld> no_inputs_;  ///< the journal's files
  mutable std::mutex mutex_;
  std::condition_variable idle_;
  std::deque<Status> history_;                         ///< newest last; never empty
  std::chrono::steady_clock::time_point published_{};  ///< the newest
  std::function<void()> notify_;
  std::shared_ptr<const LinkReport> links_;  ///< newest
  PlanInHand plan_;
  Runner* runner_ = nullptr;
  bool busy_ = false, starting_ = false, ending_ = false, abort_early_ = false;
  std::string held_;  ///< why no session may begin; empty: one may
  std::uint64_t aborts_ = 0;
  std::uint64_t stops_ = 0;  ///< aborts of anybody
  int waiting_ = 0;  ///< starts that wait until the session before has let its devices go
  std::thread thread_;
};

}  // namespace cellcal::daemon
