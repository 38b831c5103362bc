#include "daemon/service/service.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cstddef>
#include <utility>

#include "calib/check/controller_model.h"
#include "calib/files/calibration_json.h"
#include "calib/model/enum_table.h"
#include "calib/model/kinematics.h"
#include "calib/plan/cell_check.h"
#include "calib/plan/online.h"
#include "calib/result/finding_phrase.h"
#include "daemon/archive/drift_watch.h"
#include "daemon/files/atomic_file.h"
#include "daemon/files/log_context.h"
#include "daemon/service/job.h"
#include "daemon/service/journal_recorder.h"
#include "daemon/service/kind.h"
#include "daemon/session/rules.h"
#include "daemon/session/state.h"
#include "daemon/tasks/options.h"
#include "daemon/tasks/planned_round.h"
#include "daemon/tasks/tasks.h"

namespace cellcal::daemon {

namespace {

Waiting waiting_of(const State& state, drivers::TimePoint now) {
  const rules::Missing missing = rules::missing(state);
  const double left_s = std::chrono::duration<double>(*state.deadline - now).count();
  return {missing.robot, missing.contact, std::max(0.0, left_s), state.how_to_start};
}

double seconds_to(drivers::TimePoint then, const Job& job) {
  return std::max(0.0, std::chrono::duration<double>(then - job.backend->clock().now()).count());
}

/// Fields of touches chosen one by one.
void set_choice_progress(const State& state, const Job& job, Status& status) {
  if (job.options.goal.u95_m > 0.0) status.goal_m = job.options.goal.u95_m;
  status.finding = state.progress.finding;
  status.stage = state.stage;
  if (state.progress.u95_m > 0.0) {
    status.u95_m = state.progress.u95_m;
    status.mean_error_m = state.progress.mean_m;
  }
  status.why_ended = calib::why_ended(state.progress, job.options.goal);
}

/// Leaves `seq`, `links`, `made`, `results_dir` and `time_left_s` to the caller. `done`: number of touches
/// made, including those before a resume.
Status status_of(const State& state, const Job& job, std::size_t done) {
  Status status;
  status.session = job.session;
  status.kind = to_string(job.options.kind);
  status.load = job.options.load;
  status.anew = state.anew;
  status.phase = state.phase;
  status.done = std::max(state.done, done);
  const calib::Calibration* calibration = state.result ? state.result->calibration() : nullptr;
  status.residual_m = calibration != nullptr ? calibration->after.mean_m : state.residual_m;
  status.robot_words = state.links.robot_words;
  status.contact_words = state.links.contact_words;
  status.failure = state.failure;
  status.warnings = job.warnings;
  if (const auto model = calib::finding_of(job.stated_poses->judged(), job.cell.robot))
    status.warnings.push_back(phrase(*model));
  status.interruptions = job.interruptions;
  for (std::size_t i = 0; i < status.interruptions.of.size(); ++i)
    status.interruptions.of[i] += state.interruptions.of[i];
  if (state.busy_until && kAwaitingPhases.has(state.phase))
    status.busy_left_s = seconds_to(*state.busy_until, job);
  if (state.phase == Phase::kConnecting && state.deadline)
    status.waiting = waiting_of(state, job.backend->clock().now());
  if (state.plan) {
    status.total = std::max(state.total(), status.done);
    if (const calib::PlannedTouch* touch = state.at_hand()) status.target = touch->target;
    if (const auto fault = calib::fault_of(job.cell, *state.plan))
      status.warnings.push_back(phrase(*fault));
  }
  if (job.options.one_by_one) set_choice_progress(state, job, status);
  const bool given_up = state.phase == Phase::kFailed || state.phase == Phase::kAborted;
  if (state.result && !given_up) status.outcome = outcome_of(*state.result);
  if (calibration != nullptr) status.reasons = calib::words(calibration->verdict.findings);
  return status;
}

/// History for a slow poller; one touch produces some twenty statuses.
constexpr std::size_t kHistory = 512;
/// A robot's link is closed within 2 s; a session requested meanwhile waits for it.
constexpr std::chrono::seconds kClosing{4};
/// Longest wait for a short exclusive operation (try_exclusively()).
constexpr std::chrono::seconds kBrief{20};

/// The newest session, where it is unfinished.
std::optional<InterruptedSession> interrupted_session(Journal& journal) {
  try {
    const auto record = journal.newest_resumable();
    if (!record || record->state == RecordState::kDamaged) return std::nullopt;
    const auto options = options_in(record->inputs);
    InterruptedSession left{record->id,
                            record->touches,
                            record->planned,
                            record->started,
                            record->state,
                            options ? anew(*options, record->inputs) : "",
                            to_string(options ? options->kind : SessionKind::kCalibrate)};
    if (!record->failure.empty()) left.failure = failure_from_journal(record->failure).kind;
    return left;
  } catch (const JournalError& damaged) {
    spdlog::warn("the newest session cannot be resumed: {}", damaged.what());
    return std::nullopt;
  }
}

struct HoldGuard {
  SessionService& service;
  ~HoldGuard() { service.release(); }
};

}  // namespace

SessionService::SessionService(ServiceParts parts) : parts_(std::move(parts)) {
  for (const auto& file : parts_.journal.files()) no_inputs_.emplace_back(file);
  history_.emplace_back();
  history_.back().interrupted = interrupted_session(parts_.journal);
}

SessionService::~SessionService() { shutdown(); }

void SessionService::hold(const std::string& words) {
  std::unique_lock lock(mutex_);
  idle_.wait_for(lock, kBrief, [&] { return !briefly_ || ending_; });
  if (ending_) throw BusyError("the daemon is being stopped; start it again");
  if (busy_ || waiting_ > 0)
    throw BusyError("session " + std::to_string(history_.back().session) +
                    " is under way and has the devices. Wait for its end, or abort it");
  if (!held_.empty()) throw BusyError(held_);
  held_ = words;
}

void SessionService::release() {
  const std::lock_guard lock(mutex_);
  held_.clear();
  briefly_ = false;
  idle_.notify_all();
}

void SessionService::wait_for_room(std::unique_lock<std::mutex>& lock, std::chrono::seconds limit,
                                   const std::function<bool()>& room) {
  const std::uint64_t seen = stops_;
  ++waiting_;
  idle_.wait_for(lock, limit, [&] { return stops_ != seen || ending_ || room(); });
  --waiting_;
  if (stops_ != seen) throw BusyError("aborted before it began: no session was started");
}

std::int64_t SessionService::start(const RunRequest& request) {
  {
    std::unique_lock lock(mutex_);
    const bool closing = is_final(history_.back().phase);
    // Either wait also ends when another session has started meanwhile.
    if (busy_ && closing)
      wait_for_room(lock, kClosing,
                    [&] { return !busy_ || starting_ || !is_final(history_.back().phase); });
    if (briefly_) wait_for_room(lock, kBrief, [&] { return !briefly_ || busy_; });
    if (ending_) throw BusyError("the daemon is being stopped; start it again");
    if (request.unless_aborted && *request.unless_aborted != aborts_)
      throw BusyError("aborted before it began: no session was started");
    if (busy_ && starting_) throw BusyError("a session is being prepared. See 'cellcal status'");
    if (busy_) {
      const std::string session = "session " + std::to_string(history_.back().session);
      throw BusyError(closing && is_final(history_.back().phase)
                          ? session +
                                " has ended, but its end is not on disk yet or a link is still "
                                "closing. Try again; if it stays so, check the disk"
                          : session +
                                " is running. See 'cellcal status', stop it with 'cellcal abort'");
    }
    if (!held_.empty()) throw BusyError(held_);
    busy_ = starting_ = true;
    abort_early_.reset();
  }
  try {
    if (thread_.joinable()) thread_.join();
    RunRequest one_spelling = request;  // calibrations are found by the path of their cell
    one_spelling.cell = request.cell.lexically_normal();
    return begin(one_spelling);
  } catch (...) {
    const std::lock_guard lock(mutex_);
    busy_ = starting_ = false;
    idle_.notify_all();
    throw;
  }
}

/// Reads the inputs, prepares the job and starts the session's thread.
std::int64_t SessionService::begin(const RunRequest& request) {
  SessionSettings settings;
  MakeBackend make_backend;
  {
    const std::lock_guard lock(mutex_);
    settings = parts_.settings;
    make_backend = parts_.make_backend;
  }
  std::unique_ptr<Job> job = prepare(parts_.journal, request, std::move(settings), make_backend);
  {
    const std::lock_guard lock(mutex_);
    if (ending_) throw BusyError("the daemon is being stopped; start it again");
  }
  const std::string now = job->backend->utc_now();
  if (job->resumed) {
    parts_.journal.resume(job->session, now);
  } else {
    job->started = now;
    job->inputs.options = options_to_json(job->options);
    job->session = parts_.journal.begin(job->inputs, now);
    // After a restored backup: the folder of a lost session of that number is not this one's.
    try {
      if (const auto aside = set_aside(results_dir(job->session)); !aside.empty())
        spdlog::warn("session {}: results of an earlier session of this number are now in {}",
                     job->session, aside.string());
    } catch (const std::exception& failed) {
      spdlog::error("session {}: {}", job->session, system_words(failed));
    }
  }
  const LogScope scope({.session = job->session, .event = LogEvent::kSessionBegins});
  spdlog::info("session {} {}: {}", job->session, job->resumed ? "resumed" : "begins",
               job->inputs.cell_name);
  if (!job->unattended.empty()) parts_.journal.note(job->session, now, job->unattended);
  const std::int64_t session = job->session;
  job->news = TouchPublication(session, job->cell, job->touches.size());
  {
    const std::lock_guard lock(mutex_);
    links_.reset();  // of an earlier session, as is what is known of the arm
    arm_ = {};
  }
  State first;
  first.phase = Phase::kPlanning;
  publish(first, job->touches, *job);
  const std::lock_guard lock(mutex_);
  thread_ = std::thread([this, job = std::move(job)] { run(*job); });
  starting_ = false;
  idle_.notify_all();
  return session;
}

void SessionService::alone(const char* what, const std::function<void()>& act) {
  hold(fmt::format("{} is under way. Try again when it has ended", what));
  const HoldGuard held{*this};
  act();
}

bool SessionService::try_exclusively(const char* what, const std::function<void()>& act) {
  {
    const std::lock_guard lock(mutex_);
    if (ending_ || busy_ || waiting_ > 0 || !held_.empty()) return false;
    held_ = fmt::format("{} is under way. Try again when it has ended", what);
    briefly_ = true;
  }
  const HoldGuard held{*this};
  act();
  return true;
}

void SessionService::run(Job& job) {
  try {
    carry_out(job);
  } catch (const std::exception& error) {
    // The runner has not started: no device was opened.
    State failed;
    failed.phase = Phase::kFailed;
    failed.failure = Failure{FailureKind::kUnexpectedEvent, error.what()};
    spdlog::critical("session {} could not start: {}", job.session, error.what());
    publish(failed, job.touches, job);
    try {
      const RecordEnd end{Ending::kFailed, to_journal(*failed.failure), failed.failure};
      JournalRecorder(parts_.journal, job.session, *job.backend,
                      std::make_shared<const calib::ArmModel>(job.cell.robot, job.cell.tool),
                      parts_.ending)
          .record(end);
    } catch (const std::exception& record_error) {
      spdlog::warn("session {}: its failed start is not recorded: {}", job.session,
                   record_error.what());
    }
  }
  job.backend.reset();
  if (const auto links = status().links)
    keep_links({false, links->robot, links->contact, links->positioner_axes});
  const std::lock_guard lock(mutex_);
  busy_ = false;
  idle_.notify_all();
}

std::optional<calib::DriftChart> SessionService::checks_of(const std::string& cell) try {
  const auto drift = DriftWatch(parts_.journal).evaluate(cell);
  return drift ? std::optional(drift->chart) : std::nullopt;
} catch (const std::runtime_error& error) {  // the result does not depend on it
  spdlog::warn("the report is without checks: {}", error.what());
  return std::nullopt;
}

TaskInputs SessionService::task_inputs(Job& job) {
  TaskInputs inputs;
  inputs.cell = job.cell;
  inputs.cell.passable = job.backend->passable();
  inputs.axis_reach_rad = job.backend->axis_reach_rad();
  inputs.files = job.inputs;
  inputs.options = job.options;
  inputs.made = job.touches;
  if (job.left) inputs.left = *job.left;
  inputs.note = [this, &job](const std::string& words) {
    parts_.journal.note(job.session, job.backend->utc_now(), words);
    spdlog::info("session {}: {}", job.session, words);
  };
  const Kind& kind = kind_of(job.options);
  inputs.compared = kind.compared(parts_.journal, job);
  kind.add_inputs(inputs, parts_.journal, job);
  inputs.session = job.session;
  inputs.started = job.started;
  inputs.results_dir = results_dir(job.session);
  inputs.utc_now = [&job] { return job.backend->utc_now(); };
  inputs.store = [this, &job, compared = inputs.compared](const std::string& json) {
    parts_.journal.store_calibration(job.session, json, compared);
  };
  inputs.readings = [this, &job] { return parts_.journal.readings(job.session); };
  inputs.interruptions = [this] { return status().interruptions; };
  inputs.checks_so_far = [this, cell = job.inputs.cell_name] { return checks_of(cell); };
  inputs.controller_model = [poses = job.stated_poses] { return poses->judge(); };
  inputs.truth = [&job](const calib::Calibration& calibration) {
    return job.backend->truth(calibration);
  };
  return inputs;
}

void SessionService::carry_out(Job& job) {
  const auto inputs = std::make_shared<const TaskInputs>(task_inputs(job));
  JournalRecorder recorder(parts_.journal, job.session, *job.backend,
                           std::make_shared<const calib::ArmModel>(job.cell.robot, job.cell.tool),
                           parts_.ending);
  // The workers are destroyed first: their jobs use the objects declared above.
  std::unique_ptr<Worker> worker, disk;
  if (job.backend->virtual_time()) {
    worker = std::make_unique<InlineWorker>();
    disk = std::make_unique<InlineWorker>();
  } else {
    worker = std::make_unique<ThreadWorker>();
    disk = std::make_unique<ThreadWorker>(ThreadWorker::Priority::kNormal);
  }
  Runner runner({*job.backend, recorder, *worker, *disk,
                 with_controller_model(kind_of(job.options).tasks(inputs), inputs),
                 [this, &job](const State& now, const std::vector<calib::Touch>& touches) {
                   publish(now, touches, job);
                 },
                 [this, axes = job.cell.robot.positioner.size()](
                     const drivers::RobotState& robot, const drivers::ContactStatus& contact) {
                   keep_links({true, robot, contact, axes});
                 },
                 [&job](const drivers::RobotState& robot) { job.stated_poses->observe(robot); },
                 [&job](const drivers::Move& move, const drivers::RobotState& robot) {
                   return job.hand_speed ? job.hand_speed->share(move, robot) : 1.0;
                 },
                 [this](const calib::WorkDone& done) { publish_work(done); }},
                first_state(job), job.touches);
  {
    const std::lock_guard lock(mutex_);
    runner_ = &runner;
    if (abort_early_) runner.request_abort(*abort_early_);
  }
  runner.run();
  {
    const std::lock_guard lock(mutex_);
    runner_ = nullptr;
  }
  watch_delay(parts_.journal, job.session, job.backend->utc_now());
  worker.reset();
}

void SessionService::publish(const State& state, const std::vector<calib::Touch>& touches,
                             Job& job) {
  Status status = status_of(state, job, touches.size());
  if (state.phase == Phase::kDone) status.results_dir = results_dir(job.session).string();
  status.made = job.news.next(state, touches);
  if (status.made && status.made->residual_m)
    parts_.journal.note(job.session, AssessedTouch{status.made->index, *status.made->residual_m});
  status.time_left_s =
      job.time_left.update(state.phase, status.done, status.total, job.backend->clock().now());

  // State of the driver at this instant: the newest sample is up to 0.2 s older.
  std::optional<drivers::RobotState> robot;
  if (job.backend) robot = job.backend->robot().state();
  {
    const std::lock_guard lock(mutex_);
    status.seq = history_.back().seq + 1;
    if (history_.back().session != status.session) made_.clear();
    if (status.made) made_.push_back(status.made);
    status.links = links_;
    status.schedule = history_.back().schedule;
    const auto now = parts_.clock();
    if (robot) arm_.update(*robot, now);
    status.arm = arm_.seen(now);
    plan_ = {job.session, job.options.one_by_one ? state.chosen_after : 0, state.plan};
    published_ = now;
    history_.push_back(std::move(status));
    if (history_.size() > kHistory) history_.pop_front();
  }
  notify();
}

/// Publishes planning progress as a change of its own; dropped once the session has left that phase.
void SessionService::publish_work(const calib::WorkDone& done) {
  publish_changed([&](Status& status) {
    status.planning = done;
    return status.phase == Phase::kPlanning;
  });
}

void SessionService::show(const ScheduleSeen& schedule) {
  publish_changed(
      [&](Status& status) { return std::exchange(status.schedule, schedule) != schedule; });
}

void SessionService::publish_changed(const std::function<bool(Status&)>& change) {
  {
    const std::lock_guard lock(mutex_);
    const auto now = parts_.clock();
    Status status = newest(now);
    if (!change(status)) return;
    status.made.reset();  // already published
    ++status.seq;
    published_ = now;
    history_.push_back(std::move(status));
    if (history_.size() > kHistory) history_.pop_front();
  }
  notify();
}

void SessionService::keep_links(LinkReport report) {
  auto kept = std::make_shared<const LinkReport>(std::move(report));
  const std::lock_guard lock(mutex_);
  if (kept->open) arm_.update(kept->robot, parts_.clock());
  links_ = std::move(kept);
}

std::uint64_t SessionService::aborts() const {
  const std::lock_guard lock(mutex_);
  return aborts_;
}

bool SessionService::abort(const Aborted& by) {
  const std::lock_guard lock(mutex_);
  if (!by.why) ++aborts_;
  ++stops_;  // wakes the starts that wait
  idle_.notify_all();
  if (!starting_ && (!busy_ || is_final(history_.back().phase))) return waiting_ > 0;
  if (!starting_ && runner_ != nullptr)
    runner_->request_abort(by);
  else if (!abort_early_ || !by.why)
    abort_early_ = by;
  return true;
}

Status SessionService::status() const {
  const std::lock_guard lock(mutex_);
  return newest(parts_.clock());
}

Status SessionService::newest(drivers::TimePoint now) const {
  Status status = history_.back();
  status.links = links_;
  status.arm = arm_.seen(now);
  if (status.waiting) {
    const std::chrono::duration<double> since = now - published_;
    status.waiting->left_s = std::max(0.0, status.waiting->left_s - since.count());
  }
  return status;
}

CurrentPlan SessionService::plan() const {
  const std::lock_guard lock(mutex_);
  return plan_;
}

std::vector<std::shared_ptr<const MadeTouch>> SessionService::made(std::int64_t session) const {
  const std::lock_guard lock(mutex_);
  if (made_.empty() || made_.front()->session != session) return {};
  return made_;
}

std::vector<Status> SessionService::since(std::uint64_t seq) const {
  const std::lock_guard lock(mutex_);
  const auto first = std::upper_bound(
      history_.begin(), history_.end(), seq,
      [](std::uint64_t newest, const Status& status) { return newest < status.seq; });
  return {first, history_.end()};
}

bool SessionService::alive() {
  const std::lock_guard lock(mutex_);
  return runner_ == nullptr || runner_->alive();
}

void SessionService::on_change(std::function<void()> notify) {
  const std::lock_guard lock(mutex_);
  notify_ = std::move(notify);
}

void SessionService::notify() {
  const std::lock_guard in_order(notifying_);
  std::function<void()> call;
  {
    const std::lock_guard lock(mutex_);
    call = notify_;
  }
  if (call) call();
}

void SessionService::use(SessionSettings settings, MakeBackend make_backend) {
  const std::lock_guard lock(mutex_);
  parts_.settings = std::move(settings);
  parts_.make_backend = std::move(make_backend);
}

void SessionService::shutdown() {
  {
    std::unique_lock lock(mutex_);
    ending_ = true;
    idle_.wait(lock, [this] { return !starting_; });
  }
  abort({FailureKind::kDaemonStopped});
  if (thread_.joinable()) thread_.join();
}

std::filesystem::path SessionService::results_dir(std::int64_t session) const {
  return parts_.state_dir / "sessions" / std::to_string(session);
}

std::filesystem::path SessionService::backups_dir() const { return parts_.state_dir / "backups"; }

std::filesystem::path SessionService::imports_dir() const { return parts_.state_dir / "imports"; }

}  // namespace cellcal::daemon
