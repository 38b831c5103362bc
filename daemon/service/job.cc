#include "daemon/service/job.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <set>
#include <stdexcept>
#include <utility>

#include "calib/files/files.h"
#include "calib/model/error.h"
#include "calib/model/iso_time.h"
#include "calib/model/units.h"
#include "calib/plan/candidates.h"
#include "calib/plan/cell_check.h"
#include "calib/plan/duration.h"
#include "calib/plan/finder.h"
#include "daemon/files/atomic_file.h"
#include "daemon/service/kind.h"
#include "daemon/session/rules.h"
#include "daemon/tasks/planned_round.h"

namespace cellcal::daemon {

namespace {

/// Cell checks made before anything is opened, planned or moved.
std::vector<calib::Phrase> examine_cell(const calib::Cell& cell, bool by_centres) {
  try {
    std::vector<calib::Phrase> warnings = calib::refuse_faulty(cell, by_centres);
    for (const calib::Phrase& warning : warnings) spdlog::warn("{}", words(warning));
    return warnings;
  } catch (const calib::PlanError& wrong) {
    throw RequestError(wrong.what());
  }
}

/// A resumed session keeps its original parameters; its search limits are those of the current link.
void check_search_limits(std::int64_t session, const TouchPolicy& touch,
                         const SearchLimits& limits) {
  const auto refuse = [&](const char* key, double value, double most, const char* unit) {
    throw RequestError(fmt::format(
        "session {} has {} = {:g}{}, at most {:g}{} are permitted{}. Resume with the link and configuration that it "
        "began with, or start a new session",
        session, key, value, unit, most, unit, limits.because.empty() ? "" : " " + limits.because));
  };
  // 0.5 nm/s: both values may have been converted from millimetres.
  constexpr double kRounding = 5e-10;
  for (const auto& [key, speed] : {std::pair("fast_search_mm_s", touch.fast_m_s),
                                   std::pair("slow_search_mm_s", touch.slow_m_s)})
    if (!(speed <= limits.fastest_m_s + kRounding))
      refuse(key, calib::kMmPerM * speed, calib::kMmPerM * limits.fastest_m_s, " mm/s");
  if (touch.confirm_every > limits.most_confirm_every)
    refuse("confirm_every", touch.confirm_every, limits.most_confirm_every, "");
}

void examine_load(const calib::Cell& cell, const std::string& load) {
  if (load.empty() || std::ranges::find(cell.loads, load, &calib::Load::id) != cell.loads.end())
    return;
  std::string known;
  for (const calib::Load& one : cell.loads) known += (known.empty() ? "" : ", ") + one.id;
  throw RequestError(fmt::format("load {}: the cell has no such [[load]]; it has: {}", load,
                                 known.empty() ? "none" : known));
}

/// Months since a session ended.
double months_since(const std::string& ended, const std::string& now) {
  constexpr double kMonthS = 30.44 * 86400.0;
  const auto from = calib::seconds_of(ended), to = calib::seconds_of(now);
  return from && to ? std::max(0.0, (*to - *from) / kMonthS) : 0.0;
}

/// Restores the job of a resumed session.
void restore_session(Journal& journal, const RunRequest& request, Job& job) {
  const std::optional<SessionRecord> record = journal.newest_resumable();
  if (!record) {
    throw RequestError(
        "nothing to resume: the newest session is done, or there is none; an earlier one is not resumed, since the cell "
        "may have changed after it. Start one with 'cellcal run --cell CELL'");
  }
  job.session = record->id;
  job.inputs = record->inputs;
  job.options = options_from_json(record->inputs.options);
  if (const std::string command = anew(job.options, job.inputs); !command.empty())
    throw RequestError(fmt::format("session {}, the newest, is not resumed. Start a new one: '{}'",
                                   record->id, command));
  check_search_limits(record->id, job.options.touch, job.settings.search_limits);
  job.started = record->started;
  job.expected_hash = record->plan_hash;
  job.touches = journal.touches(record->id);
  job.interruptions = journal.interruptions(record->id);
  job.resumed = true;
  job.options.accept_change |= request.accept_change;
  if (!request.cell.empty() && read_inputs(request.cell).cell_text != record->inputs.cell_text) {
    throw RequestError("the cell file has changed since session " + std::to_string(record->id) +
                       " began. Resume without --cell to use the stored one, or start a new "
                       "session");
  }
}

/// Options of the request, as opposed to those of the configuration.
void apply_request_options(const RunRequest& request, Job& job) {
  job.options.plan.fit_touches = request.fit_touches.value_or(calib::kUsualTouches);
  job.options.find = request.find;
  job.options.update = request.update;
  job.options.accept_change = request.accept_change;
  job.options.goal.u95_m = request.goal_mm.value_or(0.0) / calib::kMmPerM;
  job.options.goal.most_touches =
      request.fit_touches.value_or(request.goal_mm ? kMostChosen : calib::kUsualTouches);
  // A fixed number of touches, whatever they contribute.
  if (!request.goal_mm) job.options.goal.worth_it = 0.0;
  job.options.region = request.region;
  try {
    job.options.plan.region = calib::parse_accuracy_region(request.region);
  } catch (const calib::PlanError& wrong) {
    throw RequestError(wrong.what());
  }
  job.options.plan.check_touches = request.check_touches;
  job.options.plan.seed = request.seed;
  job.options.load = request.load;
  job.options.touch = job.settings.touch;
  job.options.kind = request.kind;
  job.options.target = request.target;
}

void check_goal_value(const RunRequest& request, const Job& job) {
  if (!request.goal_mm || !request.fit_touches) return;
  const auto targets = std::count_if(
      job.cell.targets.begin(), job.cell.targets.end(), [](const calib::Target& target) {
        return calib::is_planned(target, calib::Kinds::kSpheresAndPlanes);
      });
  if (const auto least = targets * calib::kFirstTouches; *request.fit_touches < least) {
    throw RequestError(
        fmt::format("at least {2} touches are needed with a goal ({0} on each of {1} targets), not "
                    "{3}",
                    calib::kFirstTouches, targets, least, *request.fit_touches));
  }
}

/// Checks of a new session, before anything is opened, planned or moved.
void check_new_session(const RunRequest& request, Job& job) {
  const SessionOptions& options = job.options;
  // A calibration knows the centres better, a search first finds them.
  const bool by_centres = !options.find && !options.update && options.kind != SessionKind::kCheck;
  job.warnings = examine_cell(job.cell, by_centres);
  if (request.goal_mm)
    if (const auto fault = calib::fault_of(job.cell, job.options.goal))
      job.warnings.push_back(phrase(*fault));
  examine_load(job.cell, request.load);
  kind_of(job.options).examine(job);
}

/// Its way out was planned clear of the obstacles in that session's files, so it holds for the same files
/// only.
std::shared_ptr<const calib::SearchUnderWay> search_left(Journal& journal,
                                                         const SessionInputs& inputs) {
  try {
    std::optional<LeftSearch> left = journal.search_left();
    if (!left) return nullptr;
    const std::optional<SessionRecord> by = journal.session(left->session);
    if (!by || by->inputs.cell_text != inputs.cell_text ||
        by->inputs.robot_text != inputs.robot_text)
      return nullptr;
    return std::make_shared<const calib::SearchUnderWay>(std::move(left->search));
  } catch (const DamagedError& damaged) {
    spdlog::warn("the path out of the previous search is not used: {}", damaged.what());
    return nullptr;
  }
}

void check_axis_count(const Job& job) {
  const std::size_t axes = job.cell.robot.joints.size() + job.cell.robot.positioner.size();
  if (axes > drivers::kMaxAxes) {
    throw RequestError("the robot file has " + std::to_string(axes) +
                       " axes, more than can be driven: " + std::to_string(drivers::kMaxAxes));
  }
}

/// True where a calibration of this cell on the real arm, run by this installation, has completed.
bool calibrated_before(Journal& journal, const std::string& cell) {
  const auto is_one = [&](const SessionRecord& record) {
    if (record.state != RecordState::kDone || record.inputs.cell_name != cell || record.origin)
      return false;
    const auto options = options_in(record.inputs);
    return options && options->kind == SessionKind::kCalibrate && !options->emulated;
  };
  // Newest first: one of the last few sessions usually is a calibration.
  constexpr std::size_t kPage = 50;
  std::vector<SessionRecord> page =
      journal.sessions(std::numeric_limits<std::int64_t>::max(), kPage);
  while (!page.empty() && std::none_of(page.begin(), page.end(), is_one))
    page = journal.sessions(page.back().id, kPage);
  return !page.empty();
}

HandSpeed hand_speed_of(Journal& journal, const Job& job, double most_speed) {
  const double fraction = std::min(job.settings.speed_fraction, most_speed);
  return HandSpeed(std::make_shared<const calib::ArmModel>(job.cell), fraction,
                   {job.settings.hand_speed_m_s, !calibrated_before(journal, job.inputs.cell_name),
                    job.settings.positioner_speed_rad_s},
                   job.cell.targets);
}

/// Lower bound of the share, also used where the speed of a path is unknown: a slower move outlasts its
/// deadline.
constexpr double kLeastShare = 1e-3;

/// Angles of the arm and of the positioner.
struct Angles {
  std::vector<double> arm, positioner;
};

Angles angles(const drivers::AxisAngles& from, const calib::Robot& robot) {
  const auto behind =
      from.end() - static_cast<std::ptrdiff_t>(std::min(robot.positioner.size(), from.size()));
  return {{from.begin(), behind}, {behind, from.end()}};
}

constexpr int kMostTouches = 2000;
constexpr double kColdestC = -40.0, kWarmestC = 80.0;  // plausible temperatures of a robot cell
constexpr double kFinestGoalMm = 0.01, kCoarsestGoalMm = 10.0;

}  // namespace

std::unique_ptr<Job> prepare(Journal& journal, const RunRequest& request, SessionSettings settings,
                             const MakeBackend& make_backend) {
  check(request);
  auto job = std::make_unique<Job>();
  job->settings = std::move(settings);
  job->unattended = request.unattended;
  if (request.resume) {
    restore_session(journal, request, *job);
  } else {
    apply_request_options(request, *job);
    kind_of(job->options).begin(journal, request, *job);
  }
  const Kind& kind = kind_of(job->options);
  job->cell = cell_of(job->inputs);
  (void)kind.compared(journal, *job);  // throws before the first touch, not after the last
  check_goal_value(request, *job);
  if (!request.resume) job->options.one_by_one = kind.chooses(*job);
  // Meshes are not stored in the journal: collisions are checked against the cell as it is now.
  calib::load_meshes(job->cell, std::filesystem::path(job->inputs.cell_name).parent_path());
  if (!request.resume) check_new_session(request, *job);
  check_axis_count(*job);
  if (job->cell.robot.absolute_accuracy == calib::AbsoluteAccuracy::kActive)
    job->warnings.emplace_back("say.session.absolute_accuracy");
  if (job->options.one_by_one && (job->options.find || must_find(job->cell)))
    job->left = search_left(journal, job->inputs);
  job->backend = make_backend(job->cell, kind.most_speed(), job->options.load);
  job->stated_poses = std::make_shared<StatedPoses>(job->cell.robot, job->backend->stated_frames());
  if (!request.resume) job->options.emulated = job->backend->emulated();
  if (job->options.emulated != job->backend->emulated())
    throw RequestError(fmt::format(
        "session {} has touched {}, and the configuration now has {}. Set backend as it was, or start a new session",
        job->session, job->options.emulated ? "an emulated cell" : "the real arm",
        job->backend->emulated() ? "an emulated cell" : "the real arm"));
  if (!job->backend->emulated()) job->hand_speed = hand_speed_of(journal, *job, kind.most_speed());
  if (job->options.update)
    job->options.months = months_since(job->last_ended, job->backend->utc_now());
  return job;
}

State first_state(const Job& job) {
  State state;
  state.policy = job.options.touch;
  state.load = job.options.load;
  state.timeouts = job.settings.timeouts;
  state.retries = job.settings.retries;
  state.repeats = job.settings.repeats;
  state.how_to_start = job.backend->how_to_start();
  state.one_by_one = job.options.one_by_one;
  state.resumed = job.resumed;
  state.left = job.left;
  state.unattended = !job.unattended.empty();
  state.done = job.touches.size();
  for (const calib::Touch& touch : job.touches) state.met.push_back(touch.target);
  state.expected_hash = job.expected_hash;
  state.anew = anew(job.options, job.inputs);
  kind_of(job.options).adapt(state, job);
  return state;
}

HandSpeed::HandSpeed(std::shared_ptr<const calib::ArmModel> arm, double speed_fraction, Bound bound,
                     const std::vector<calib::Target>& targets)
    : arm_(std::move(arm)), speed_fraction_(speed_fraction), bound_(bound) {
  for (const calib::Target& target : targets) {
    const auto axes = static_cast<std::size_t>(target.carried_by);
    if (axes == 0) continue;
    if (target.has_centre) carried_.push_back({axes, target.centre_m});
    const Eigen::AlignedBox3d box(target.low_m, target.high_m);
    for (int corner = 0; target.has_box && corner < 8; ++corner)
      carried_.push_back({axes, box.corner(static_cast<Eigen::AlignedBox3d::CornerType>(corner))});
  }
}

double HandSpeed::share(const drivers::Move& move, const drivers::RobotState& robot) const {
  using Mode = drivers::OperatingMode;
  const bool applies =
      robot.mode == Mode::kT1 || (bound_.mode_unknown && robot.mode == Mode::kUnknown);
  if (!applies || !(bound_.speed_m_s > 0.0) || move.cruise_s > 0.0) return 1.0;
  Angles from = angles(robot.commanded_rad, arm_->robot());
  double share = 1.0;
  const auto leg_to = [&](const drivers::AxisAngles& at_rad) {
    Angles to = angles(at_rad, arm_->robot());
    const bool known = from.arm.size() == to.arm.size() &&
                       static_cast<int>(to.arm.size()) == arm_->joint_count() &&
                       from.positioner.size() == to.positioner.size();
    share = known ? std::min({share, share_of_leg(from.arm, to.arm),
                              share_of_turn(from.positioner, to.positioner)})
                  : kLeastShare;
    from = std::move(to);
  };
  for (const drivers::Via& via : move.via) leg_to(via.at_rad);
  leg_to(move.target_rad);
  return std::max(share, kLeastShare);
}

double HandSpeed::share_of_leg(const std::vector<double>& from,
                               const std::vector<double>& to) const {
  double shortest_s = 0.0;  // at the axis limits
  for (std::size_t i = 0; i < to.size(); ++i) {
    const double limit_rad_s = arm_->robot().joints[i].max_speed_rad_s * speed_fraction_;
    if (limit_rad_s > 0.0)
      shortest_s = std::max(shortest_s, std::abs(to[i] - from[i]) / limit_rad_s);
  }
  const double fastest_m = calib::fastest_point_m_s(*arm_, from, to);
  return fastest_m > 0.0 ? std::min(1.0, bound_.speed_m_s * shortest_s / fastest_m) : 1.0;
}

double HandSpeed::share_of_turn(const std::vector<double>& from,
                                const std::vector<double>& to) const {
  if (!(bound_.positioner_rad_s > 0.0)) return 1.0;
  double shortest_s = 0.0;
  for (std::size_t j = 0; j < to.size(); ++j)
    shortest_s = std::max(shortest_s, std::abs(to[j] - from[j]) / bound_.positioner_rad_s);
  const double fastest_m = fastest_carried_m(from, to);
  return fastest_m > 0.0 ? std::min(1.0, bound_.speed_m_s * shortest_s / fastest_m) : 1.0;
}

/// Greatest speed of a carried target's centre, or of a corner of its box, in a turn of one second, within 1 % [m/s].
double HandSpeed::fastest_carried_m(std::vector<double> at, const std::vector<double>& to) const {
  constexpr int kSteps = 90;
  const std::vector<double> from = at;
  const auto place = [&](const Carried& one) {
    return Eigen::Vector3d(calib::carried_at(arm_->robot(), std::span(at).first(one.axes)) *
                           one.place_m);
  };
  double fastest_m = 0.0;
  for (const Carried& one : carried_) {
    at = from;
    Eigen::Vector3d before = place(one);
    for (int k = 1; k <= kSteps; ++k) {
      for (std::size_t j = 0; j < at.size(); ++j) at[j] = from[j] + (to[j] - from[j]) * k / kSteps;
      const Eigen::Vector3d now = place(one);
      fastest_m = std::max(fastest_m, kSteps * (now - before).norm());
      before = now;
    }
  }
  return fastest_m;
}

std::optional<double> TimeLeft::update(Phase phase, std::size_t done, std::size_t total,
                                       drivers::TimePoint now) {
  if (!first_move_ && phase == Phase::kTransit) {
    first_move_ = now;
    done_at_first_move_ = last_done_ = done;
  }
  if (first_move_ && done > last_done_) {
    last_done_ = done;
    last_touch_ = now;
  }
  const std::size_t made = last_done_ - done_at_first_move_;
  if (!first_move_ || made == 0) return std::nullopt;
  if (kAwaitingPhases.has(phase)) return left_s_;
  const Phases touching = kMovingPhases | kStandingPhases;
  if (!touching.has(phase)) return std::nullopt;
  using Seconds = std::chrono::duration<double>;
  const double each_s = Seconds(last_touch_ - *first_move_).count() / static_cast<double>(made);
  const double since_s = Seconds(now - last_touch_).count();
  left_s_ =
      std::max(0.0, each_s * (static_cast<double>(total) - static_cast<double>(done)) - since_s);
  return left_s_;
}

std::string anew(const SessionOptions& options, const SessionInputs& inputs) {
  std::string command = kind_of(options).command(options, inputs);
  if (!command.empty() && !options.load.empty()) command += " --load " + shell_word(options.load);
  return command;
}

void Kind::begin(Journal&, const RunRequest& request, Job& job) const {
  job.inputs = read_inputs(request.cell);
}

const Kind& kind_of(SessionKind kind, bool update) {
  switch (kind) {  // no default: a value without a class does not compile
    case SessionKind::kCalibrate: return update ? update_kind() : calibration_kind();
    case SessionKind::kQualify: return qualification_kind();
    case SessionKind::kCheck: return check_kind();
    case SessionKind::kFind: return find_kind();
    case SessionKind::kDryRun: return dry_run_kind();
  }
  throw std::logic_error("no class for this kind of session");
}

/// Session record of a calibration. Throws RequestError where its cell file has changed since.
SessionRecord unchanged(SessionRecord record) {
  const SessionInputs now = read_inputs(record.inputs.cell_name);
  if (now.cell_text != record.inputs.cell_text || now.robot_text != record.inputs.robot_text)
    throw RequestError(fmt::format(
        "{} or its robot file has changed since session {} calibrated it. Put it back, or "
        "calibrate again",
        record.inputs.cell_name, record.id));
  return record;
}

void expect_contacts(State& first, const calib::Cell& cell) {
  first.policy.confirm_every = std::numeric_limits<int>::max();
  for (const calib::Target& target : cell.targets) first.met.push_back(target.id);
}

void check(const RunRequest& request) {
  const Kind::Parameters takes = kind_of(request.kind, request.update).parameters();
  if (request.resume && request.kind != SessionKind::kCalibrate)
    throw RequestError("a session is resumed with its own kind: leave kind out");
  const bool of_a_calibration = takes.compares && request.cell.empty();
  if (!request.resume && !of_a_calibration && !request.cell.is_absolute()) {
    throw RequestError("give the cell file as an absolute path, not \"" + request.cell.string() +
                       "\"");
  }
  if (const int touches = request.fit_touches.value_or(calib::kUsualTouches);
      touches < 4 || touches > kMostTouches) {
    throw RequestError("touches (fit) must be 4 to 2000, not " + std::to_string(touches));
  }
  if (request.goal_mm &&
      !(*request.goal_mm >= kFinestGoalMm && *request.goal_mm <= kCoarsestGoalMm)) {
    throw RequestError(fmt::format("the goal must be {} to {} mm, not {}", kFinestGoalMm,
                                   kCoarsestGoalMm, *request.goal_mm));
  }
  if (request.update && request.kind != SessionKind::kCalibrate)
    throw RequestError(
        "\"update\" applies to a calibration: leave it out of a check or qualification");
  if (request.resume && !request.load.empty())
    throw RequestError("a resumed session keeps its load: leave \"load\" out");
  if (request.update && request.resume)
    throw RequestError("an update is not resumed: start a new one, without \"resume\"");
  if ((request.goal_mm && !takes.goal) || (request.find && !takes.find) ||
      (request.fit_touches && !takes.touches))
    throw RequestError(takes.refusal);
  if (request.seed != RunRequest{}.seed && !takes.seed)
    throw RequestError("checks are compared by the same touches: leave seed out");
  if (!takes.compares && request.calibration)
    throw RequestError(
        "\"calibration\" applies to a check: a calibration begins from the files alone");
  if (!takes.compares && !request.mastered.empty())
    throw RequestError("\"mastered\" applies to a check: leave it out");
  if (std::set(request.mastered.begin(), request.mastered.end()).size() != request.mastered.size())
    throw RequestError("\"mastered\" names a joint twice");
  if (!takes.compares && request.temperature_c)
    throw RequestError("\"temperature_c\" applies to a check: leave it out");
  if (request.temperature_c &&
      !(*request.temperature_c >= kColdestC && *request.temperature_c <= kWarmestC))
    throw RequestError(fmt::format("temperature_c must be {} to {} degrees Celsius, not {}",
                                   kColdestC, kWarmestC, *request.temperature_c));
  if (!takes.target && !request.target.empty())
    throw RequestError("\"target\" applies to a qualification: a calibration touches all targets");
  if (request.check_touches < 0 || request.check_touches > kMostTouches) {
    throw RequestError("check touches must be 0 to 2000, not " +
                       std::to_string(request.check_touches));
  }
}

}  // namespace cellcal::daemon
