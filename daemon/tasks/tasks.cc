#include "daemon/tasks/tasks.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <set>

#include "calib/files/calibration_json.h"
#include "calib/files/files.h"
#include "calib/files/input_file.h"
#include "calib/model/iso_time.h"
#include "calib/model/units.h"
#include "calib/plan/cell_check.h"
#include "calib/plan/design.h"
#include "calib/plan/duration.h"
#include "calib/plan/lowest.h"
#include "calib/plan/touch_sequence.h"
#include "calib/result/finding_phrase.h"
#include "daemon/files/atomic_file.h"
#include "daemon/files/correction_limit.h"
#include "daemon/report/report.h"
#include "daemon/result/outcome_json.h"
#include "daemon/tasks/planned_round.h"

namespace cellcal::daemon {

namespace {

void append(std::string& bytes, const calib::JointVector& joints) {
  const std::size_t old = bytes.size();
  bytes.resize(old + joints.size() * sizeof(double));
  if (!joints.empty()) std::memcpy(&bytes[old], joints.data(), joints.size() * sizeof(double));
}

/// Invariants used in the session's arithmetic; a violation is a defect of the planner.
void check(const calib::Plan& plan, std::size_t joints) {
  for (const calib::PlannedTouch& touch : plan.touches) {
    const bool lengths_fit = touch.standoff.size() == joints && touch.end.size() == joints &&
                             touch.clear.size() == joints;
    const bool sound = lengths_fit && std::isfinite(touch.search_m) && touch.search_m > 0.0 &&
                       std::isfinite(touch.expected_m);
    if (!sound)
      throw calib::PlanError(
          calib::PlanError::Kind::kDefect, touch.target,
          "the planned touch on " + touch.target + " is not valid. Please report this");
  }
}

/// The cell for the choice of touches: with the transmission errors that its last calibration learnt.
calib::Cell cell_to_plan(const TaskInputs& inputs) {
  if (!inputs.compared) return inputs.cell;
  const calib::Calibration last =
      calib::calibration_from_json(inputs.compared->calibration, inputs.compared->words);
  return with_functions_of(last.cell.robot, inputs.cell);
}

/// Touches chosen one by one. Used by the worker only, job after job.
class Chooser {
 public:
  /// `chosen`: receives every chosen touch.
  Chooser(std::shared_ptr<const TaskInputs> inputs,
          std::shared_ptr<std::optional<calib::Plan>> chosen, bool only_find)
      : inputs_(std::move(inputs)), only_find_(only_find), all_(std::move(chosen)) {}

  Tasks::Planned begin() {
    if (const auto fault = calib::fault_of(inputs_->cell, inputs_->options.goal);
        fault && inputs_->note && !only_find_)
      inputs_->note("warning: " + words(phrase(*fault)));
    open_sequence();
    return {{}, "", sequence_->progress()};
  }

  Tasks::Chosen choose(const ChooseTouch& how, const std::vector<calib::Touch>& touches,
                       const calib::JointVector& from) {
    const PartedAxes axes = parted(inputs_->cell.robot, from);
    try {
      if (begin_->empty()) {
        *begin_ = axes.arm_rad;
        // Paths found before may exceed the controller's limit.
        if (plans_within_reach()) open_sequence();
      }
      return choose_from(how, touches, axes);
    } catch (const calib::PlanError& error) {
      if (!is_bounded()) throw;
      throw calib::PlanError(
          error.kind, error.target,
          fmt::format(
              "{}. Also, [rsi] correction_limit_deg keeps every axis within {:.0f} deg of where "
              "the session began: a wider limit allows more postures",
              error.what(), *inputs_->axis_reach_rad * calib::kDegPerRad));
    }
  }

 private:
  static constexpr double kAnyTurnRad = 6.2, kInsideRad = 0.005;

  bool is_bounded() const {
    return inputs_->axis_reach_rad && *inputs_->axis_reach_rad < kAnyTurnRad;
  }

  /// A positioner's touches are planned from where the arm waits, at once: their reach is looked at afterwards.
  bool plans_within_reach() const {
    return is_bounded() &&
           (inputs_->cell.robot.positioner.empty() || (sequence_ && sequence_->progress().finding));
  }

  void open_sequence() {
    calib::Cell cell = cell_to_plan(*inputs_);
    if (plans_within_reach()) cell.passable = within_reach(cell.passable);
    const calib::TouchSequenceOptions options{inputs_->options.plan, inputs_->options.goal,
                                              inputs_->options.find, only_find_, inputs_->left};
    sequence_.emplace(cell, options, inputs_->made);
    learnt_ = inputs_->made.size();
  }

  /// Restricts postures to the controller's limit around the session's start, once known.
  calib::Passable within_reach(calib::Passable also) const {
    return [begin = begin_, reach = *inputs_->axis_reach_rad - kInsideRad, also = std::move(also)](
               const calib::JointVector& from, const calib::JointVector& to) {
      for (std::size_t i = 0; i < begin->size(); ++i)
        if (std::abs(from[i] - (*begin)[i]) > reach || std::abs(to[i] - (*begin)[i]) > reach)
          return false;
      return !also || also(from, to);
    };
  }

  Tasks::Chosen choose_from(const ChooseTouch& how, const std::vector<calib::Touch>& touches,
                            const PartedAxes& from) {
    Tasks::Chosen chosen;
    if (!*all_) all_->emplace().start = from.arm_rad;
    std::optional<calib::PlannedTouch> touch;
    try {
      if (how.failed) sequence_->failed(*how.failed);
      while (learnt_ < touches.size()) sequence_->touched(touches[learnt_++]);
      touch = sequence_->next(from.arm_rad, how.in_contact, from.positioner_rad);
    } catch (const calib::PlanError& error) {
      if (error.kind != calib::PlanError::Kind::kNotFound) throw;
      chosen.not_found = true;
      chosen.why = error.what();
    }
    chosen.search = sequence_->under_way(from.arm_rad, touch);
    if (touch) {
      auto& all = (*all_)->touches;  // a touch offered before now has another path
      if (!all.empty() && all.back().clear == touch->clear) all.pop_back();
      if (!touch->may_miss) all.push_back(*touch);
      chosen.plan.touches.push_back(std::move(*touch));
    } else {
      chosen.plan.home = sequence_->way_home(from.arm_rad);
      chosen.plan.home_rad = from.positioner_rad;
    }
    check(chosen.plan, inputs_->cell.robot.joints.size());
    if (!from.positioner_rad.empty()) refuse_beyond_reach(*inputs_, chosen.plan, 0, *begin_);
    chosen.progress = sequence_->progress();
    chosen.stage = sequence_->stage();
    return chosen;
  }

  std::shared_ptr<const TaskInputs> inputs_;
  bool only_find_;
  /// Position of the arm at the first request; empty before.
  std::shared_ptr<calib::JointVector> begin_ = std::make_shared<calib::JointVector>();
  std::shared_ptr<std::optional<calib::Plan>> all_;
  std::optional<calib::TouchSequence> sequence_;
  std::size_t learnt_ = 0;
};

std::string finished_time(const std::vector<calib::Touch>& touches, const std::string& now) {
  return touches.empty() || touches.back().time.empty() ? now : touches.back().time;
}

void write_touches(const TaskInputs& inputs, const std::vector<calib::Touch>& touches) {
  std::filesystem::create_directories(inputs.results_dir);
  write_atomically(inputs.results_dir / "touches.csv",
                   calib::format_touches(touches, inputs.cell.robot));
}

/// "none, part (10 kg)"; empty where nothing was held.
std::string loads_held(const calib::Cell& cell, const std::vector<calib::Touch>& touches) {
  std::string words;
  std::set<std::string> ids;
  for (const calib::Touch& touch : touches) ids.insert(touch.load);
  if (ids == std::set<std::string>{""}) return words;
  for (const std::string& id : ids) {
    const auto load = std::ranges::find(cell.loads, id, &calib::Load::id);
    words += words.empty() ? "" : ", ";
    words += load == cell.loads.end() ? "0 kg" : fmt::format("{} ({:g} kg)", id, load->mass_kg);
  }
  return words;
}

/// This calibration is the newest change.
std::optional<calib::DriftChart> checks_up_to(const TaskInputs& inputs,
                                              const calib::Calibration& calibration,
                                              const std::string& finished) {
  if (!inputs.checks_so_far) return std::nullopt;
  std::optional<calib::DriftChart> chart = inputs.checks_so_far();
  if (!chart) return std::nullopt;
  calib::DriftEvent& event = chart->events.emplace_back();
  if (calibration.update) event.kind = calib::DriftEventKind::kUpdated;
  event.session = inputs.session;
  event.time_s = calib::seconds_of(finished).value_or(0.0);
  event.accepted = inputs.options.accept_change;
  return chart;
}

/// Content that calibration, touches and interruptions determine.
ReportInput report_of(const calib::Calibration& calibration,
                      const std::vector<calib::Touch>& touches, std::int64_t session,
                      const std::string& cell_name, const InterruptionCounts& counts) {
  ReportInput report;
  report.calibration = calibration;
  report.touches = touches;
  report.session_id = std::to_string(session);
  report.cell_name = std::filesystem::path(cell_name).filename().string();
  report.software = calib::software_version();
  if (counts.total() > 0)
    report.notes.emplace_back("say.report.note.interruptions",
                              std::vector<calib::PhraseValue>{{"causes", phrase(counts)}});
  if (const std::string held = loads_held(calibration.cell, touches); !held.empty())
    report.notes.emplace_back("say.report.note.loads",
                              std::vector<calib::PhraseValue>{{"loads", held}});
  if (calibration.update)
    report.notes.emplace_back(
        "say.report.note.update",
        std::vector<calib::PhraseValue>{
            {"stands_on", calib::calibration_phrase(calibration.update->stands_on)}});
  report.error_map = calib::error_map(calibration);
  return report;
}

}  // namespace

std::string plan_hash(const calib::Plan& plan) {
  std::string bytes;
  append(bytes, plan.start);
  for (const calib::PlannedTouch& touch : plan.touches) {
    bytes += touch.target;
    bytes += touch.set == calib::TouchSet::kFit ? '\0' : '\1';
    append(bytes, touch.positioner_rad);
    for (const calib::JointVector& waypoint : touch.wait) append(bytes, waypoint);
    for (const calib::JointVector& waypoint : touch.transit) append(bytes, waypoint);
    append(bytes, touch.standoff);
    append(bytes, touch.end);
    append(bytes, touch.clear);
    append(bytes, {touch.search_m, touch.expected_m});
    append(bytes, {touch.leaving.in_share, touch.leaving.out_share});
    if (touch.search_m_s > 0.0) append(bytes, {touch.search_m_s});
    for (const calib::Corner& corner : touch.corners)
      append(bytes, {corner.in_share, corner.out_share});
  }
  for (const calib::JointVector& waypoint : plan.home) append(bytes, waypoint);
  return calib::sha256(bytes);
}

Tasks::Planned plan_beforehand(const TaskInputs& inputs) {
  Tasks::Planned planned{calib::make_plan(cell_to_plan(inputs), inputs.options.plan), "", {}};
  check(planned.plan, inputs.cell.robot.joints.size());
  planned.hash = plan_hash(planned.plan);
  return planned;
}

void refuse_beyond_reach(const TaskInputs& inputs, const calib::Plan& plan, std::size_t next,
                         const calib::JointVector& begin) {
  if (!inputs.axis_reach_rad) return;
  const LimitNeeded needed = limit_needed(plan, inputs.cell.robot, begin, next);
  const double limit_deg = *inputs.axis_reach_rad * calib::kDegPerRad;
  if (needed.turn_deg > limit_deg)
    throw calib::PlanError(calib::PlanError::Kind::kOutOfReach,
                           beyond_limit_words(needed, limit_deg));
}

Tasks with_route(Tasks tasks, const SharedInputs& inputs) {
  // Position at the begin of the controller's session.
  const auto begin = std::make_shared<calib::JointVector>();
  tasks.route = [inputs, begin](const calib::Plan& plan, const FindRoute& how,
                                const calib::JointVector& from) {
    const auto& [arm_rad, positioner_rad] = parted(inputs->cell.robot, from);
    calib::Plan routed =
        calib::resume_plan(inputs->cell, plan, how.next, arm_rad, how.in_contact, positioner_rad);
    check(routed, arm_rad.size());
    if (begin->empty()) *begin = arm_rad;
    refuse_beyond_reach(*inputs, routed, how.next, *begin);
    return routed;
  };
  return tasks;
}

Tasks touching_tasks(const SharedInputs& inputs,
                     const std::shared_ptr<std::optional<calib::Plan>>& planned, bool only_find) {
  Tasks tasks;
  if (inputs->options.one_by_one) {
    const auto chooser = std::make_shared<Chooser>(inputs, planned, only_find);
    tasks.plan = [chooser] { return chooser->begin(); };
    tasks.choose = [chooser](const ChooseTouch& how, const std::vector<calib::Touch>& touches,
                             const calib::JointVector& from) {
      return chooser->choose(how, touches, from);
    };
  } else {
    tasks.plan = [inputs, planned] {
      Tasks::Planned now = plan_beforehand(*inputs);
      *planned = now.plan;
      if (const auto fault = calib::fault_of(inputs->cell, now.plan); fault && inputs->note)
        inputs->note("warning: " + words(phrase(*fault)));
      if (const auto low = calib::below_feet(inputs->cell, now.plan); low && inputs->note)
        inputs->note("warning: " + words(phrase(*low)));
      return now;
    };
  }
  return with_route(std::move(tasks), inputs);
}

Tasks with_controller_model(Tasks tasks, const SharedInputs& inputs) {
  if (!inputs->controller_model) return tasks;
  tasks.assess = [inputs, assess = tasks.assess](const std::vector<calib::Touch>& touches) {
    inputs->controller_model();
    return assess(touches);
  };
  tasks.identify = [inputs, identify = tasks.identify](const std::vector<calib::Touch>& touches) {
    SessionResult result = identify(touches);
    const calib::ControllerModel model = inputs->controller_model();
    const auto finding = calib::finding_of(model, inputs->cell.robot);
    if (auto* calibration = std::get_if<calib::Calibration>(&result.of); finding && calibration)
      calibration->verdict.add_first(*finding);
    if (inputs->note)
      inputs->note(fmt::format("{}controller's model: {}", finding ? "warning: " : "",
                               words(phrase(model, inputs->cell.robot))));
    return result;
  };
  return tasks;
}

void write_document(const TaskInputs& inputs, const SessionResult& result,
                    const std::vector<calib::Touch>& touches, const char* name) {
  write_touches(inputs, touches);
  write_atomically(inputs.results_dir / name, document_of(result));
}

ReportInput report_from_journal(Journal& journal, const SessionRecord& record) {
  const std::vector<calib::Touch> touches = journal.touches(record.id);
  ReportInput report = report_of(
      calib::calibration_from_json(record.calibration, fmt::format("session {}", record.id)),
      touches, record.id, record.inputs.cell_name, journal.interruptions(record.id));
  report.started = record.started;
  report.finished = finished_time(touches, record.ended);
  report.notes.emplace_back("say.report.note.from_journal");
  if (options_from_json(record.inputs.options).emulated)
    report.notes.emplace_back("say.report.note.emulated");
  return report;
}

void write_results(const TaskInputs& inputs, const calib::Calibration& calibration,
                   const std::vector<calib::Touch>& touches,
                   const std::optional<calib::Plan>& plan) {
  const std::string json = calib::calibration_to_json(calibration);

  ReportInput report =
      report_of(calibration, touches, inputs.session, inputs.files.cell_name,
                inputs.interruptions ? inputs.interruptions() : InterruptionCounts{});
  report.started = inputs.started;
  report.finished = finished_time(touches, inputs.utc_now());
  report.truth = inputs.truth(calibration);
  report.plan = plan;
  report.checks = checks_up_to(inputs, calibration, report.finished);
  if (plan) report.planned_s = calib::duration_s(*plan, inputs.cell.robot, {});

  write_touches(inputs, touches);
  write_atomically(inputs.results_dir / "calibration.json", json);
  for (const std::string& code : calib::Language::codes()) {
    report.language = *calib::Language::of(code);
    write_atomically(inputs.results_dir / report_name(report.language), html_report(report));
    write_atomically(inputs.results_dir / plots_name(report.language),
                     plots_json(inputs.session, report_plots(report)));
  }
  inputs.store(json);
}

}  // namespace cellcal::daemon
