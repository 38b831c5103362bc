#include "daemon/service/service.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <limits>

#include "calib/files/calibration_json.h"
#include "calib/files/files.h"
#include "calib/model/error.h"
#include "calib/plan/cell_check.h"
#include "calib/plan/qualification_plan.h"
#include "calib/plan/reach/candidates.h"
#include "calib/words/finding_words.h"
#include "daemon/files/log_context.h"
#include "daemon/service/check_against.h"
#include "daemon/service/delay_watch.h"
#include "daemon/service/inputs.h"
#include "daemon/service/journal_recorder.h"
#include "daemon/service/last_calibration.h"
#include "daemon/service/tasks.h"
#include "daemon/service/touch_news.h"
#include "daemon/session/rules.h"

namespace cellcal::daemon {

namespace {

/// Enough for a watcher that looks once in a while; one touch is some twenty statuses.
constexpr std::size_t kHistory = 512;
/// A robot's link is closed within 2 s; a session asked for meanwhile waits for it.
constexpr std::chrono::seconds kClosing{4};

/// The newest, where the daemon that ran it went away in its midst.
std::optional<InterruptedSession> interrupted_session(Journal& journal) {
  try {
    const auto record = journal.newest_resumable();
    if (!record || record->state != "interrupted") return std::nullopt;
    return InterruptedSession{record->id, record->touches, record->planned, record->started};
  } catch (const JournalError& damaged) {
    spdlog::warn("the newest session cannot be resumed: {}", damaged.what());
    return std::nullopt;
  }
}

constexpr int kMostTouches = 2000;
constexpr double kFinestGoalMm = 0.01, kCoarsestGoalMm = 10.0;

bool must_find(const calib::Cell& cell) {
  return std::any_of(cell.targets.begin(), cell.targets.end(), [](const calib::Target& target) {
    return target.kind == calib::TargetKind::kSphere && !target.has_centre;
  });
}

/// Before anything is opened, planned or moved.
void look_at_cell(const calib::Cell& cell) {
  try {
    for (const std::string& warning : calib::refuse_faulty(cell)) spdlog::warn("{}", warning);
  } catch (const calib::PlanError& wrong) {
    throw RequestError(wrong.what());
  }
}

/// The delay is read off two speeds. (So the slowest search is fast enough for one arming, too.)
void look_at_speeds(const TouchPolicy& touch) {
  if (touch.fast_m_s - touch.slow_m_s >= kLeastSpeedDifferenceMS) return;
  throw RequestError(fmt::format(
      "fast_search_mm_s = {:g} and slow_search_mm_s = {:g}: a qualification needs {:g} mm/s between them. Set "
      "them under [motion]",
      1e3 * touch.fast_m_s, 1e3 * touch.slow_m_s, 1e3 * kLeastSpeedDifferenceMS));
}

/// A session is gone on with as it began. What permits its searches is today's link.
void look_at_limits(std::int64_t session, const TouchPolicy& touch, const SearchLimits& limits) {
  const auto refuse = [&](const char* key, double value, double most, const char* unit) {
    throw RequestError(fmt::format(
        "session {} has {} = {:g}{}, at most {:g}{} are permitted{}. Resume with the link and configuration that it "
        "began with, or start a new session",
        session, key, value, unit, most, unit, limits.because.empty() ? "" : " " + limits.because));
  };
  // Half a nanometre per second: both may have been computed from millimetres.
  constexpr double kRounding = 5e-10;
  for (const auto& [key, speed] : {std::pair("fast_search_mm_s", touch.fast_m_s),
                                   std::pair("slow_search_mm_s", touch.slow_m_s)})
    if (!(speed <= limits.fastest_m_s + kRounding))
      refuse(key, 1e3 * speed, 1e3 * limits.fastest_m_s, " mm/s");
  if (touch.confirm_every > limits.most_confirm_every)
    refuse("confirm_every", touch.confirm_every, limits.most_confirm_every, "");
}

void look_at_target(const calib::Cell& cell, const std::string& target) {
  try {
    calib::qualification_target(cell, target);
  } catch (const calib::PlanError& wrong) {
    throw RequestError(wrong.what());
  }
}

void check(const RunRequest& request) {
  const bool checks = request.kind == SessionKind::kCheck;
  if (!request.resume && !(checks && request.cell.empty()) && !request.cell.is_absolute()) {
    throw RequestError("give the cell file as an absolute path, not \"" + request.cell.string() +
                       "\"");
  }
  if (const int touches = request.fit_touches.value_or(kPlannedTouches);
      touches < 4 || touches > kMostTouches) {
    throw RequestError("touches (fit) must be 4 to 2000, not " + std::to_string(touches));
  }
  if (request.goal_mm &&
      !(*request.goal_mm >= kFinestGoalMm && *request.goal_mm <= kCoarsestGoalMm)) {
    throw RequestError(fmt::format("the goal must be {} to {} mm, not {}", kFinestGoalMm,
                                   kCoarsestGoalMm, *request.goal_mm));
  }
  if (request.kind == SessionKind::kQualify &&
      (request.goal_mm || request.find || request.fit_touches))
    throw RequestError("a qualification has its own touches: leave goal_mm, find and touches out");
  if (checks && (request.goal_mm || request.find || request.fit_touches))
    throw RequestError("a check has its own touches: leave goal_mm, find and touches out");
  if (!checks && request.calibration)
    throw RequestError("\"calibration\" is of a check: a calibration begins from the files alone");
  if (request.kind != SessionKind::kQualify && !request.target.empty())
    throw RequestError("\"target\" is of a qualification: a calibration touches all targets");
  if (request.check_touches < 0 || request.check_touches > kMostTouches) {
    throw RequestError("check touches must be 0 to 2000, not " +
                       std::to_string(request.check_touches));
  }
}

/// The calibration predicts every contact, so only the first (for the latch's delay) and surprising ones are
/// confirmed.
void prepare_check(const calib::Cell& cell, State& state) {
  state.policy.confirm_every = std::numeric_limits<int>::max();
  for (const calib::Target& target : cell.targets) state.met.push_back(target.id);
}

/// The calibration that is to be checked, and its cell file as it was; it has to be that still.
SessionRecord look_at_calibration(Journal& journal, const RunRequest& request) {
  try {
    SessionRecord record = published_session(journal, request.cell, request.calibration);
    const SessionInputs now = read_inputs(record.inputs.cell_name);
    if (now.cell_text != record.inputs.cell_text || now.robot_text != record.inputs.robot_text)
      throw RequestError(fmt::format(
          "{} or its robot file has changed since session {} calibrated it. Put it back, or "
          "calibrate again",
          record.inputs.cell_name, record.id));
    return record;
  } catch (const NothingToCheck& nothing) {
    throw RequestError(nothing.what());
  }
}

}  // namespace

/// All that one session needs, until it has ended.
struct SessionService::Job {
  std::int64_t session = 0;
  calib::Cell cell;
  SessionInputs inputs;
  SessionOptions options;
  SessionSettings settings;
  std::string started;
  std::string expected_hash;
  bool resumed = false;
  std::string unattended;
  std::vector<calib::Touch> touches;
  std::unique_ptr<Backend> backend;

  TouchNews news;

  // For the time left.
  std::size_t done_at_first_move = 0;
  std::optional<drivers::TimePoint> first_move;
  drivers::TimePoint last_touch{};
  std::size_t last_done = 0;
};

SessionService::SessionService(ServiceParts parts) : parts_(std::move(parts)) {
  for (const auto& file : parts_.journal.files()) no_inputs_.emplace_back(file);
  history_.emplace_back();
  history_.back().interrupted = interrupted_session(parts_.journal);
}

SessionService::~SessionService() { shutdown(); }

void SessionService::hold(const std::string& words) {
  const std::lock_guard lock(mutex_);
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
}

std::unique_ptr<SessionService::Job> SessionService::prepare(const RunRequest& request) {
  check(request);
  auto job = std::make_unique<Job>();
  MakeBackend make_backend;
  {
    const std::lock_guard lock(mutex_);
    job->settings = parts_.settings;
    make_backend = parts_.make_backend;
  }
  job->unattended = request.unattended;
  if (request.resume) {
    const std::optional<SessionRecord> record = parts_.journal.newest_resumable();
    if (!record) {
      throw RequestError(
          "nothing to resume: the newest session is done, or there is none. Start one with "
          "'cellcal run --cell CELL'");
    }
    job->session = record->id;
    job->inputs = record->inputs;
    job->options = options_from_json(record->inputs.options);
    if (job->options.kind == SessionKind::kCheck)
      throw RequestError("session " + std::to_string(record->id) +
                         " is a check, which is not resumed. Start a new one: cellcal check");
    look_at_limits(record->id, job->options.touch, job->settings.search_limits);
    job->started = record->started;
    job->expected_hash = record->plan_hash;
    job->touches = parts_.journal.touches(record->id);
    job->resumed = true;
    job->options.accept_change |= request.accept_change;
    if (!request.cell.empty() && read_inputs(request.cell).cell_text != record->inputs.cell_text) {
      throw RequestError("the cell file has changed since session " + std::to_string(record->id) +
                         " began. Resume without --cell to use the stored one, or start a new "
                         "session");
    }
  } else {
    if (request.kind == SessionKind::kCheck) {
      const SessionRecord calibrated = look_at_calibration(parts_.journal, request);
      job->inputs = calibrated.inputs;
      job->options.against = calibrated.id;
    } else {
      job->inputs = read_inputs(request.cell);
    }
    job->options.plan.fit_touches = request.fit_touches.value_or(kPlannedTouches);
    job->options.find = request.find;
    job->options.accept_change = request.accept_change;
    job->options.goal.u95_m = request.goal_mm.value_or(0.0) * 1e-3;
    job->options.goal.most_touches =
        request.fit_touches.value_or(request.goal_mm ? kMostChosen : kPlannedTouches);
    if (!request.goal_mm) job->options.goal.worth_it = 0.0;  // so many, whatever they bring
    job->options.region = request.region;
    try {
      job->options.plan.region = calib::parse_accuracy_region(request.region);
    } catch (const calib::PlanError& wrong) {
      throw RequestError(wrong.what());
    }
    job->options.plan.check_touches = request.check_touches;
    job->options.plan.seed = request.seed;
    job->options.touch = job->settings.touch;
    job->options.kind = request.kind;
    job->options.target = request.target;
  }
  job->cell = cell_of(job->inputs);
  if (request.goal_mm && request.fit_touches) {
    const auto targets = std::count_if(
        job->cell.targets.begin(), job->cell.targets.end(), [](const calib::Target& target) {
          return calib::is_planned(target, calib::Kinds::kSpheresAndPlanes);
        });
    if (const auto least = targets * calib::kFirstTouches; *request.fit_touches < least) {
      throw RequestError(fmt::format(
          "at least {2} touches are needed with a goal ({0} on each of {1} targets), not "
          "{3}",
          calib::kFirstTouches, targets, least, *request.fit_touches));
    }
  }
  if (!request.resume && request.kind == SessionKind::kCalibrate)
    job->options.one_by_one = request.goal_mm || job->options.find || must_find(job->cell);
  if (!request.resume && request.kind == SessionKind::kCheck) job->options.one_by_one = true;
  // Not in the journal: what stands in the cell now is what must not be hit now.
  calib::load_meshes(job->cell, std::filesystem::path(job->inputs.cell_name).parent_path());
  if (!request.resume) look_at_cell(job->cell);
  if (!request.resume && request.kind == SessionKind::kQualify) {
    look_at_target(job->cell, request.target);
    look_at_speeds(job->options.touch);
  }
  if (job->cell.robot.joints.size() > drivers::kMaxAxes) {
    throw RequestError("the robot file has " + std::to_string(job->cell.robot.joints.size()) +
                       " joints, more than can be driven: " + std::to_string(drivers::kMaxAxes));
  }
  job->backend = make_backend(job->cell);
  return job;
}

std::int64_t SessionService::start(const RunRequest& request) {
  {
    std::unique_lock lock(mutex_);
    const bool closing = is_final(history_.back().phase);
    if (busy_ && closing) {
      const std::uint64_t seen = stops_;
      ++waiting_;
      // Ends as well where another start has taken the place meanwhile.
      idle_.wait_for(lock, kClosing, [&] {
        return !busy_ || stops_ != seen || ending_ || starting_ || !is_final(history_.back().phase);
      });
      --waiting_;
      if (stops_ != seen) throw BusyError("aborted before it began: no session was started");
    }
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
    abort_early_ = false;
  }
  try {
    if (thread_.joinable()) thread_.join();
    std::unique_ptr<Job> job = prepare(request);
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
    }
    const LogScope scope({.session = job->session, .event = LogEvent::kSessionBegins});
    spdlog::info("session {} {}: {}", job->session, job->resumed ? "resumed" : "begins",
                 job->inputs.cell_name);
    if (!job->unattended.empty()) parts_.journal.note(job->session, now, job->unattended);
    const std::int64_t session = job->session;
    job->news = TouchNews(session, job->cell, job->touches.size());
    State first;
    first.phase = Phase::kPlanning;
    publish(first, job->touches, *job);
    const std::lock_guard lock(mutex_);
    thread_ = std::thread([this, job = std::move(job)] { run(*job); });
    starting_ = false;
    idle_.notify_all();
    return session;
  } catch (...) {
    const std::lock_guard lock(mutex_);
    busy_ = starting_ = false;
    idle_.notify_all();
    throw;
  }
}

void SessionService::alone(const char* what, const std::function<void()>& act) {
  hold(fmt::format("{} is under way. Try again when it has ended", what));
  struct Release {
    SessionService& service;
    ~Release() { service.release(); }
  } const release{*this};
  act();
}

void SessionService::run(Job& job) {
  try {
    carry_out(job);
  } catch (const std::exception& error) {
    // Before the runner had it: no device was opened.
    State failed;
    failed.phase = Phase::kFailed;
    failed.failure = Failure{FailureKind::kUnexpectedEvent, error.what()};
    spdlog::critical("session {} could not start: {}", job.session, error.what());
    publish(failed, job.touches, job);
  }
  job.backend.reset();
  if (const auto links = status().links) keep_links({false, links->robot, links->contact});
  const std::lock_guard lock(mutex_);
  busy_ = false;
  idle_.notify_all();
}

void SessionService::carry_out(Job& job) {
  State state;
  state.policy = job.options.touch;
  if (job.options.kind == SessionKind::kQualify) state.policy.confirm_every = 1;
  if (job.options.kind == SessionKind::kCheck) prepare_check(job.cell, state);
  state.timeouts = job.settings.timeouts;
  state.retries = job.settings.retries;
  state.how_to_start = job.backend->how_to_start();
  state.one_by_one = job.options.one_by_one;
  state.resumed = job.resumed;
  state.unattended = !job.unattended.empty();
  state.done = job.touches.size();
  for (const calib::Touch& touch : job.touches) state.met.push_back(touch.target);
  state.expected_hash = job.expected_hash;

  TaskInputs task_inputs;
  task_inputs.cell = job.cell;
  task_inputs.cell.passable = job.backend->passable();
  task_inputs.axis_reach_rad = job.backend->axis_reach_rad();
  task_inputs.files = job.inputs;
  std::stop_source planning;
  task_inputs.options = job.options;
  task_inputs.options.plan.stop = planning.get_token();
  task_inputs.made = job.touches;
  if (job.options.kind == SessionKind::kCheck) {
    task_inputs.against = std::make_shared<const calib::Calibration>(
        calibration_of(parts_.journal, job.options.against));
    task_inputs.checks_before = checks_before(parts_.journal, job.options.against, job.session);
  }
  task_inputs.note = [this, &job](const std::string& words) {
    parts_.journal.note(job.session, job.backend->utc_now(), words);
    spdlog::info("session {}: {}", job.session, words);
  };
  task_inputs.compared = last_calibration(parts_.journal, job.inputs.cell_name, job.session,
                                          job.options.accept_change);
  task_inputs.session = job.session;
  task_inputs.started = job.started;
  task_inputs.results_dir = results_dir(job.session);
  task_inputs.utc_now = [&job] { return job.backend->utc_now(); };
  task_inputs.store = [this, &job, compared = task_inputs.compared](const std::string& json) {
    parts_.journal.store_calibration(job.session, json, compared);
  };
  task_inputs.readings = [this, &job] { return parts_.journal.readings(job.session); };
  task_inputs.interruptions = [this] { return status().interruptions; };
  task_inputs.truth = [&job](const calib::Calibration& calibration) {
    return job.backend->truth(calibration);
  };

  JournalRecorder recorder(parts_.journal, job.session, *job.backend);
  // The workers go first: their jobs use what stands above.
  std::unique_ptr<Worker> worker, disk;
  if (job.backend->virtual_time()) {
    worker = std::make_unique<InlineWorker>();
    disk = std::make_unique<InlineWorker>();
  } else {
    worker = std::make_unique<ThreadWorker>();
    disk = std::make_unique<ThreadWorker>(ThreadWorker::Priority::kNormal);
  }
  Runner runner({*job.backend, recorder, *worker, *disk, make_tasks(std::move(task_inputs)),
                 [this, &job](const State& now, const std::vector<calib::Touch>& touches) {
                   publish(now, touches, job);
                 },
                 [this](const drivers::RobotState& robot, const drivers::ContactStatus& contact) {
                   keep_links({true, robot, contact});
                 }},
                std::move(state), job.touches);
  {
    const std::lock_guard lock(mutex_);
    runner_ = &runner;
    if (abort_early_) runner.request_abort();
  }
  runner.run();
  {
    const std::lock_guard lock(mutex_);
    runner_ = nullptr;
  }
  watch_delay(parts_.journal, job.session, job.backend->utc_now());
  planning.request_stop();  // of a job that the session did not wait for
  worker.reset();
}

void SessionService::publish(const State& state, const std::vector<calib::Touch>& touches,
                             Job& job) {
  Status status;
  status.session = job.session;
  status.kind = to_string(job.options.kind);
  status.phase = state.phase;
  status.done = std::max(state.done, job.touches.size());
  status.residual_m = state.calibration ? state.calibration->after.mean_m : state.residual_m;
  status.robot_words = state.links.robot_words;
  status.contact_words = state.links.contact_words;
  status.failure = state.failure;
  status.interruptions = state.interruptions;
  if (state.phase == Phase::kConnecting && state.deadline) {
    const rules::Missing missing = rules::missing(state);
    const double left_s =
        std::chrono::duration<double>(*state.deadline - job.backend->clock().now()).count();
    status.waiting =
        Waiting{missing.robot, missing.contact, std::max(0.0, left_s), state.how_to_start};
  }
  if (state.plan) {
    status.total = std::max(state.total(), status.done);
    if (state.in_hand() < state.plan->touches.size()) status.target = state.planned().target;
  }
  if (job.options.one_by_one) {
    if (job.options.goal.u95_m > 0.0) status.goal_m = job.options.goal.u95_m;
    status.finding = state.progress.finding;
    status.stage = state.stage;
    if (state.progress.u95_m > 0.0) {
      status.u95_m = state.progress.u95_m;
      status.mean_error_m = state.progress.mean_m;
    }
    status.why_ended = state.progress.why;
  }
  if (state.calibration) {
    status.publish = state.calibration->verdict.publish;
    status.reasons = calib::words(state.calibration->verdict.findings);
  }
  if (state.phase == Phase::kDone) status.results_dir = results_dir(job.session).string();
  status.made = job.news.look(state, touches);

  const drivers::TimePoint now = job.backend->clock().now();
  if (!job.first_move && state.phase == Phase::kTransit) {
    job.first_move = now;
    job.done_at_first_move = job.last_done = status.done;
  }
  if (job.first_move && status.done > job.last_done) {
    job.last_done = status.done;
    job.last_touch = now;
  }
  const std::size_t made = job.last_done - job.done_at_first_move;
  const Phases touching = kMovingPhases | kStandingPhases;
  if (job.first_move && made > 0 && touching.has(state.phase)) {
    const double each_s = std::chrono::duration<double>(job.last_touch - *job.first_move).count() /
                          static_cast<double>(made);
    const double since_s = std::chrono::duration<double>(now - job.last_touch).count();
    const double left_s = each_s * static_cast<double>(status.total - status.done) - since_s;
    status.time_left_s = std::max(0.0, left_s);
  }

  std::function<void()> notify;
  {
    const std::lock_guard lock(mutex_);
    status.seq = history_.back().seq + 1;
    status.links = links_;
    plan_ = {job.session, job.options.one_by_one ? state.done : 0, state.plan};
    published_ = std::chrono::steady_clock::now();
    history_.push_back(std::move(status));
    if (history_.size() > kHistory) history_.pop_front();
    notify = notify_;
  }
  if (notify) notify();
}

void SessionService::keep_links(LinkReport report) {
  auto kept = std::make_shared<const LinkReport>(std::move(report));
  const std::lock_guard lock(mutex_);
  links_ = std::move(kept);
}

std::uint64_t SessionService::aborts() const {
  const std::lock_guard lock(mutex_);
  return aborts_;
}

bool SessionService::abort(By by) {
  const std::lock_guard lock(mutex_);
  if (by == By::kPerson) ++aborts_;
  ++stops_;  // for the starts that wait
  idle_.notify_all();
  if (!starting_ && (!busy_ || is_final(history_.back().phase))) return waiting_ > 0;
  if (!starting_ && runner_ != nullptr)
    runner_->request_abort();
  else
    abort_early_ = true;
  return true;
}

Status SessionService::status() const {
  const std::lock_guard lock(mutex_);
  Status newest = history_.back();
  newest.links = links_;
  if (newest.waiting) {
    const std::chrono::duration<double> since = std::chrono::steady_clock::now() - published_;
    newest.waiting->left_s = std::max(0.0, newest.waiting->left_s - since.count());
  }
  return newest;
}

PlanInHand SessionService::plan() const {
  const std::lock_guard lock(mutex_);
  return plan_;
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
  abort(By::kDaemon);
  if (thread_.joinable()) thread_.join();
}

std::filesystem::path SessionService::results_dir(std::int64_t session) const {
  return parts_.state_dir / "sessions" / std::to_string(session);
}

}  // namespace cellcal::daemon
