#include "daemon/runner/runner.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <sys/resource.h>
#include <unistd.h>

#include <chrono>
#include <exception>
#include <utility>

#include "calib/model/iso_time.h"
#include "daemon/session/driver_phrase.h"
#include "daemon/session/interruption.h"

namespace cellcal::daemon {

namespace {

constexpr std::chrono::milliseconds kPollPeriod{1};
/// Reporting period of the link quality, for display.
constexpr std::chrono::milliseconds kReportPeriod{200};

bool same(const Links& a, const Links& b) {
  return a.robot == b.robot && a.contact == b.contact && a.in_contact == b.in_contact &&
         a.self_test_ok == b.self_test_ok && a.clock_ok == b.clock_ok && a.fault == b.fault &&
         a.delivery.late == b.delivery.late && a.delivery.silent == b.delivery.silent &&
         a.delivery.open == b.delivery.open && a.can_guard_retreat == b.can_guard_retreat &&
         a.interruption == b.interruption && a.interruptions == b.interruptions &&
         a.robot_session == b.robot_session && a.late == b.late &&
         a.needs_operator == b.needs_operator && a.unsettled == b.unsettled && a.mode == b.mode &&
         a.override_percent == b.override_percent && a.request == b.request &&
         a.robot_words == b.robot_words && a.contact_words == b.contact_words;
}

/// The event shows the arm at rest, with its position settled.
bool shows_rest(Phase phase, const Event& event) {
  if (event.kind() == EventKind::kContact) return true;
  return phase == Phase::kReferencing && event.get<Links>().robot == drivers::RobotLink::kReady;
}

void lower_priority() {
  // A third of a usual thread's share. With SCHED_IDLE, three busy loops on the computer extended a plan of
  // two seconds to minutes. Linux permits this to every process, per thread.
  constexpr int kNice = 5;
  ::setpriority(PRIO_PROCESS, static_cast<id_t>(::gettid()), kNice);
}

}  // namespace

/// Shared with jobs in the worker, which may outlive the runner.
struct Runner::Inbox {
  std::mutex mutex;
  std::deque<Event> events;
  int commits = 0;  ///< in progress
  /// Results of computations are no longer needed: aborted or ended.
  std::atomic<bool> called_off{false};

  std::optional<calib::WorkDone> done;  ///< unreported progress

  void report(const calib::WorkDone& now) {
    const std::lock_guard lock(mutex);
    done = now;
  }
  std::optional<calib::WorkDone> consume_progress_report() {
    const std::lock_guard lock(mutex);
    return std::exchange(done, std::nullopt);
  }
  void put(Event event) {
    const std::lock_guard lock(mutex);
    events.push_back(std::move(event));
  }
  void begin_commit() {
    const std::lock_guard lock(mutex);
    ++commits;
  }
  void end_commit(std::optional<Event> answer) {
    const std::lock_guard lock(mutex);
    if (answer) events.push_back(std::move(*answer));
    --commits;
  }
  bool committing() {
    const std::lock_guard lock(mutex);
    return commits > 0;
  }
  bool settled() {
    const std::lock_guard lock(mutex);
    return commits == 0 && events.empty();
  }
  std::optional<Event> take() {
    const std::lock_guard lock(mutex);
    if (events.empty()) return std::nullopt;
    Event event = std::move(events.front());
    events.pop_front();
    return event;
  }
};

Runner::Runner(RunnerParts parts, State state, std::vector<calib::Touch> touches)
    : parts_(std::move(parts)),
      state_(std::move(state)),
      touches_(std::move(touches)),
      inbox_(std::make_shared<Inbox>()) {}

Runner::~Runner() = default;

void Runner::request_abort(const Aborted& by) {
  if (!by.why || !abort_requested_) abort_why_ = by.why;
  abort_requested_ = true;
  inbox_->called_off = true;
}

State Runner::run() {
  try {
    run_to_end();
  } catch (const std::exception& error) {
    give_up(error.what());
  } catch (...) {
    give_up("unknown error");
  }
  inbox_->called_off = true;
  await_disk();
  return state_;
}

bool Runner::alive() {
  if (parts_.backend.virtual_time()) return true;
  const std::uint64_t turns = turns_;
  const bool devices = parts_.backend.devices_alive();
  return std::exchange(turns_seen_, turns) != turns && devices;
}

void Runner::run_to_end() {
  feed({});
  while (!is_final(state_.phase) || !inbox_->settled()) {
    ++turns_;
    if (const auto done = inbox_->consume_progress_report(); done && parts_.on_work)
      parts_.on_work(*done);
    if (gather()) continue;
    drivers::Clock& clock = parts_.backend.clock();
    clock.sleep_until(clock.now() + kPollPeriod);
  }
}

/// Jobs of the disk's worker use the recorder, which is destroyed with the session.
void Runner::await_disk() {
  drivers::Clock& clock = parts_.backend.clock();
  for (; inbox_->committing(); ++turns_) clock.sleep_until(clock.now() + kPollPeriod);
}

/// Feeds at most one event, so that an abort never waits for another event; returns whether there was one.
bool Runner::gather() {
  std::optional<Event> next = happened();
  if (!next) return false;
  feed(std::move(*next));
  return true;
}

std::optional<Event> Runner::happened() {
  if (abort_requested_.exchange(false)) return Event{Aborted{abort_why_}};
  if (auto answer = inbox_->take()) return answer;
  if (open_) {
    if (auto result = device_result()) return result;
  }
  // Before the links: frequently changing texts must not delay a deadline.
  if (state_.deadline && parts_.backend.clock().now() >= *state_.deadline) {
    state_.deadline.reset();
    return Event{Plain<EventKind::kDeadline>{}};
  }
  return open_ ? links_changed() : std::nullopt;
}

/// Before the step on a result, so that the contacts are on disk with the touch that they belong to.
void Runner::note_contacts() {
  while (auto contact = parts_.backend.contact().next_record()) {
    commit([record = RecordContact{state_.done, parts_.backend.utc_now(), *contact}](
               Recorder& recorder) { recorder.note(record); });
  }
}

std::optional<Event> Runner::device_result() {
  auto result = parts_.backend.robot().poll();
  note_contacts();  // after the event: its contacts are reported by then
  if (result) {
    return Event{
        MoveEnded{result->outcome, result->id, result->at_rad, result->interruption, result->latch},
        phrase_of(result->detail)};
  }
  if (auto answer = parts_.backend.contact().poll_arm()) {
    return Event{ArmAnswer{answer->armed, answer->arm_id, answer->refusal},
                 phrase_of(answer->why_not)};
  }
  return std::nullopt;
}

std::optional<Event> Runner::links_changed() {
  const drivers::RobotState robot = parts_.backend.robot().state();
  const drivers::ContactStatus contact = parts_.backend.contact().status();
  sensor_late_s_ = contact.quality.late_worst_s;
  if (const drivers::TimePoint now = parts_.backend.clock().now(); now >= next_report_) {
    next_report_ = now + kReportPeriod;
    if (parts_.on_sample) parts_.on_sample(robot, contact);
  }
  const Links links{robot.link,
                    robot.actual_rad,
                    robot.interruption,
                    robot.interruptions,
                    robot.session,
                    robot.late,
                    robot.needs_operator,
                    robot.unsettled,
                    robot.mode,
                    robot.override_slows,
                    robot.override_percent,
                    robot.request,
                    phrase_of(robot.words),
                    contact.link,
                    contact.in_contact == true,
                    contact.can_guard_retreat,
                    contact.self_test_ok,
                    contact.clock_ok,
                    contact.fault,
                    contact.delivery,
                    phrase_of(contact.words)};
  if (seen_ && same(*seen_, links)) return std::nullopt;
  seen_ = links;
  return Event{links};
}

void Runner::feed(Event event) {
  event.at = parts_.backend.clock().now();
  event.utc = parts_.backend.utc_now();
  if (parts_.on_rest && open_ && shows_rest(state_.phase, event))
    parts_.on_rest(parts_.backend.robot().state());
  if (event.kind() == EventKind::kRecorded && on_its_way_.written && *on_its_way_.written) {
    touches_.push_back(std::move(on_its_way_.touch));
    on_its_way_ = {};
  }
  const Phase before = state_.phase;
  Step next = step(std::move(state_), event);
  state_ = std::move(next.state);
  if (before != state_.phase) {
    note_step(before, event);
    // Re-evaluated immediately in waiting phases.
    if (kAwaitingPhases.has(state_.phase)) seen_.reset();
  }
  perform_all(next.actions);
  if (parts_.on_change) parts_.on_change(state_, touches_);
}

void Runner::note_step(Phase before, const Event& event) {
  std::string words = fmt::format("{} -> {} on {}", to_string(before), to_string(state_.phase),
                                  to_string(event.kind()));
  if (!event.words.empty()) words += ": " + calib::words(event.words);
  if (state_.failure && state_.phase == Phase::kFailed) words += " | " + describe(*state_.failure);
  RecordChange change;
  change.change = {before, state_.phase};
  change.on = event.kind();
  change.utc = event.utc;
  change.clock_s = std::chrono::duration<double>(event.at.time_since_epoch()).count();
  change.late_replies = state_.links.late;
  change.sensor_late_s = sensor_late_s_;
  commit([change, words](Recorder& recorder) {
    recorder.note(change);
    recorder.note(change.utc, words);
  });
}

void Runner::commit(std::function<void(Recorder&)> job, std::optional<Event> answer,
                    const char* what) {
  inbox_->begin_commit();
  parts_.disk.post([inbox = inbox_, &recorder = parts_.recorder, job = std::move(job),
                    answer = std::move(answer), what]() mutable {
    try {
      job(recorder);
    } catch (const std::exception& error) {
      if (what != nullptr) spdlog::error("{}: {}", what, error.what());
      answer = Event{Plain<EventKind::kJournalFailed>{}, error.what()};
    }
    inbox->end_commit(std::move(answer));
  });
}

void Runner::work(std::function<Event()> job, std::uint32_t route_id, Kind kind) {
  std::function<bool()> called_off = [inbox = inbox_, kind] {
    return kind == Kind::kComputes && inbox->called_off;
  };
  // A job run on this thread blocks the loop that would report its progress.
  auto report = [inbox = inbox_, this,
                 loop = std::this_thread::get_id()](const calib::WorkDone& done) {
    if (std::this_thread::get_id() != loop) return inbox->report(done);
    if (parts_.on_work) parts_.on_work(done);
  };
  parts_.worker.post([inbox = inbox_, job = std::move(job), route_id, report = std::move(report),
                      called_off = std::move(called_off)] {
    Event answer;
    try {
      const calib::Watch watch(called_off, report);
      calib::poll_cancelled();  // a job that has waited in the queue
      answer = job();
    } catch (const calib::Cancelled&) {
      return;  // the session ends: the answer is not needed
    } catch (const std::exception& error) {
      answer = Event{WorkFailed{route_id}, error.what()};
    }
    inbox->put(std::move(answer));
  });
}

/// Performs one action. Throws errors of devices.
struct Runner::Perform {
  Runner& runner;
  State& state = runner.state_;
  Tasks& tasks = runner.parts_.tasks;
  Backend& backend = runner.parts_.backend;

  void operator()(const MakePlan&) const {
    runner.work([plan = tasks.plan] {
      Tasks::Planned planned = plan();
      return Event{Planned{{std::make_shared<const calib::Plan>(std::move(planned.plan)),
                            {},
                            std::move(planned.progress)},
                           std::move(planned.hash)}};
    });
  }
  void operator()(const FindRoute& action) const {
    runner.work(
        [route = tasks.route, plan = state.plan, action,
         from = joint_vector(backend.robot().state().commanded_rad)] {
          return Event{Routed{{std::make_shared<const calib::Plan>(route(*plan, action, from))},
                              action.route_id}};
        },
        action.route_id);
  }
  void operator()(const ChooseTouch& action) const {
    runner.work(
        [choose = tasks.choose, action, touches = runner.touches_,
         from = joint_vector(action.from_rad.empty() ? backend.robot().state().commanded_rad
                                                     : action.from_rad)] {
          Tasks::Chosen chosen = choose(action, touches, from);
          Routed routed{{std::make_shared<const calib::Plan>(std::move(chosen.plan)),
                         std::move(chosen.stage), std::move(chosen.progress)},
                        action.route_id};
          if (chosen.search)
            routed.search =
                std::make_shared<const calib::SearchUnderWay>(std::move(*chosen.search));
          routed.not_found = chosen.not_found;
          return Event{std::move(routed), std::move(chosen.why)};
        },
        action.route_id);
  }
  void operator()(const TakeAnswer& action) const { runner.inbox_->put(*action.answer); }
  void operator()(const Assess&) const {
    runner.work([assess = tasks.assess, touches = runner.touches_] {
      Tasks::Assessed assessed;
      try {
        assessed = assess(touches);
      } catch (const calib::Cancelled&) {
        throw;
      } catch (const std::exception& error) {  // touches are made as without an expectation
        spdlog::warn("touch {} is not assessed: {}", touches.size(), error.what());
      }
      return Event{Assessed{assessed.residual_m, touches.size(), std::move(assessed.expected)}};
    });
  }
  void operator()(const Identify&) const {
    runner.work([identify = tasks.identify, touches = runner.touches_] {
      return Event{Identified{std::make_shared<const SessionResult>(identify(touches))}};
    });
  }
  void operator()(const WriteReport& action) const {
    runner.work(
        [report = tasks.report, result = action.result, touches = runner.touches_] {
          report(*result, touches);
          return Event{Plain<EventKind::kReported>{}};
        },
        0, Kind::kWrites);
  }

  void operator()(const OpenDevices&) const {
    runner.open_ = true;
    runner.seen_.reset();
    backend.robot().open();
    backend.contact().open();
  }
  void operator()(const Rereference&) const {
    backend.robot().rereference();
    runner.seen_.reset();
  }
  void operator()(const ArmSensor& action) const {
    backend.contact().arm(action.arm_id, action.lifetime);
  }
  void operator()(const Disarm&) const { backend.contact().disarm(); }
  void operator()(const SelfTest&) const {
    backend.contact().self_test();
    runner.seen_.reset();
  }
  void operator()(const BeginMove& action) const {
    drivers::Move move = action.move;
    if (runner.parts_.speed_share)
      move.speed_share = runner.parts_.speed_share(move, backend.robot().state());
    backend.robot().begin(move);
  }
  void operator()(const StopArm&) const { backend.robot().stop(); }
  void operator()(const CloseDevices&) const {
    if (!runner.open_) return;
    runner.open_ = false;
    // A device that cannot be closed can only be reported; the others are closed nevertheless.
    try_and_note("disarming the contact sensor", [&] { backend.contact().disarm(); });
    try_and_note("closing the robot's link", [&] { backend.robot().close(); });
    try_and_note("closing the contact sensor", [&] { backend.contact().close(); });
  }

  void try_and_note(const char* what, const std::function<void()>& act) const {
    try {
      act();
    } catch (const std::exception& error) {
      runner.commit([utc = backend.utc_now(), words = std::string(what) + ": " + error.what()](
                        Recorder& recorder) { recorder.note(utc, words); });
    }
  }

  template <class Record>
  void record(const Record& action, std::optional<Event> answer = {}) const {
    runner.commit([action](Recorder& recorder) { recorder.record(action); }, std::move(answer),
                  name_of(action));
  }
  void operator()(const RecordPlan& action) const { record(action); }
  void operator()(const RecordReading& action) const { record(action); }
  void operator()(const RecordTouch& action) const {
    const auto written = std::make_shared<bool>(false);
    runner.on_its_way_ = {action.touch, written};
    runner.commit(
        [action, written](Recorder& recorder) {
          recorder.record(action);
          *written = true;
        },
        Event{Plain<EventKind::kRecorded>{}}, name_of(action));
  }
  void operator()(const RecordSearch& action) const { record(action); }
  void operator()(const CheckJournal& action) const {
    runner.commit([](Recorder& recorder) { recorder.check(); },
                  Event{JournalSound{action.move_id}});
  }
  void operator()(const RecordEnd& action) const {
    record(action, Event{Plain<EventKind::kRecorded>{}});
  }
  void operator()(const RecordInterruption& action) const {
    const bool busy = action.most_of_touch > 0;
    std::string words = (busy ? "repeat " : "interruption ") + std::to_string(action.number) +
                        " of at most " + std::to_string(action.most);
    if (busy)
      words += " (of this touch " + std::to_string(action.of_touch) + " of " +
               std::to_string(action.most_of_touch) + ")";
    words += ", resuming automatically: " + action.failure;
    runner.commit(
        [utc = backend.utc_now(), words = std::move(words), by = action.by](Recorder& recorder) {
          recorder.note(utc, words);
          recorder.note(RecordCause{utc, by});
        });
  }
};

void Runner::give_up(const std::string& words) {
  const Perform perform{*this};
  if (open_) perform.try_and_note("stopping the arm", [&] { parts_.backend.robot().stop(); });
  perform(CloseDevices{});
  state_.failure =
      Failure{FailureKind::kUnexpectedEvent,
              {"say.failure.report_this",
               {{"phase", std::string("say.phase.") + to_string(state_.phase)}, {"what", words}}}};
  state_.phase = Phase::kFailed;
  perform(RecordEnd{Ending::kFailed, to_journal(*state_.failure), state_.failure});
  perform.try_and_note("reporting the end", [&] {
    if (parts_.on_change) parts_.on_change(state_, touches_);
  });
}

void Runner::perform_all(const Actions& actions) {
  for (const Action& action : actions) {
    try {
      std::visit(Perform{*this}, action);
    } catch (const std::exception& error) {
      // The remaining actions of this step depend on the failed one: they are dropped.
      spdlog::error("{}: {}", name_of(action), error.what());
      feed({Plain<EventKind::kDeviceFailed>{}, error.what()});
      return;
    }
  }
}

ThreadWorker::ThreadWorker(Priority priority)
    : thread_([this, priority] {
        if (priority == Priority::kLow) lower_priority();
        run();
      }) {}

ThreadWorker::~ThreadWorker() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  wake_.notify_one();
  thread_.join();
}

void ThreadWorker::post(std::function<void()> job) {
  {
    const std::lock_guard lock(mutex_);
    jobs_.push_back(std::move(job));
  }
  wake_.notify_one();
}

void ThreadWorker::run() {
  std::unique_lock lock(mutex_);
  while (true) {
    wake_.wait(lock, [this] { return ending_ || !jobs_.empty(); });
    if (ending_) return;
    const std::function<void()> job = std::move(jobs_.front());
    jobs_.pop_front();
    lock.unlock();
    job();
    lock.lock();
  }
}

std::string wall_clock_utc() {
  return calib::utc_text(
      std::chrono::floor<std::chrono::milliseconds>(std::chrono::system_clock::now()));
}

}  // namespace cellcal::daemon
