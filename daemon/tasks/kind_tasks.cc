#include "daemon/tasks/kind_tasks.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <utility>

#include "calib/check/mastered.h"
#include "calib/check/tcp_check.h"
#include "calib/files/calibration_json.h"
#include "calib/identify/identify_once.h"
#include "calib/identify/update.h"
#include "calib/model/error.h"
#include "calib/model/parameter_key.h"
#include "calib/plan/check_plan.h"
#include "calib/plan/duration.h"
#include "calib/plan/finder.h"
#include "calib/result/finding.h"
#include "calib/result/tcp_check.h"
#include "daemon/tasks/options.h"
#include "daemon/tasks/planned_round.h"

namespace cellcal::daemon {

namespace {

/// Plan of a check, and the results of its touches. Used by the worker only, job after job.
class Round {
 public:
  explicit Round(std::shared_ptr<const TaskInputs> inputs)
      : inputs_(std::move(inputs)), round_(inputs_, *inputs_->against) {}

  Tasks::Planned begin() {
    round_.add(calib::make_check_plan(round_.calibration(), inputs_->options.plan,
                                      mastered().empty() ? calib::CheckPlanOptions()
                                                         : calib::mastered_touches(mastered())));
    return {{}, "", round_.progress()};
  }

  Tasks::Chosen choose(const ChooseTouch& how, const std::vector<calib::Touch>& touches,
                       const calib::JointVector& from) {
    round_.learn(how, touches);
    Tasks::Chosen chosen = round_.offer(from);
    chosen.stage = "checking";
    return chosen;
  }

  SessionResult judge(const std::vector<calib::Touch>& touches) const {
    std::vector<calib::Touch> made;
    std::vector<std::size_t> planned;
    std::vector<calib::MissedTouch> missed;
    std::vector<calib::UnsteadyTouch> unsteady;
    for (std::size_t i = 0; i < round_.plan().touches.size(); ++i) {
      if (const auto touch = round_.touch_of(i)) {
        made.push_back(touches.at(*touch));
        planned.push_back(i);
      } else if (round_.became(i) == PlannedRound::Became::kMissed) {
        calib::MissedTouch one{i, {}};
        one.at_end.target = round_.plan().touches[i].target;
        one.at_end.load = inputs_->options.load;
        one.at_end.joint_rad = round_.plan().touches[i].end;
        one.at_end.positioner_rad = round_.plan().touches[i].positioner_rad;
        missed.push_back(std::move(one));
      } else {
        unsteady.push_back({i, round_.plan().touches[i].target});
      }
    }
    calib::TcpCheck check =
        calib::check_tcp(round_.calibration(), made, planned, missed, references(planned));
    check.holds &= unsteady.empty();
    check.unsteady = std::move(unsteady);
    std::vector<calib::MasteredZero> zeros;
    if (!mastered().empty() && made.size() >= calib::kLeastCheckTouches)
      zeros = calib::zeros_left(round_.calibration(), mastered(), made);
    check.holds &= std::ranges::all_of(zeros, &calib::MasteredZero::holds);
    return {std::move(check), std::move(zeros)};
  }

  std::size_t references_counted() const { return references_taken_; }
  double planned_s() const { return calib::duration_s(round_.plan(), inputs_->cell.robot, {}); }

 private:
  const std::vector<std::string>& mastered() const { return inputs_->options.mastered; }

  /// One per planned touch; null where none was made.
  std::vector<const calib::Touch*> in_order(const std::vector<calib::Touch>& touches) const {
    std::vector<const calib::Touch*> ordered(round_.plan().touches.size(), nullptr);
    for (const calib::Touch& touch : touches)
      if (const auto planned = round_.planned_of(touch)) ordered[*planned] = &touch;
    return ordered;
  }

  /// Touches of earlier checks that hold by themselves, restricted to the touches made now.
  std::vector<std::vector<calib::Touch>> references(const std::vector<std::size_t>& planned) const {
    std::vector<std::vector<calib::Touch>> all;
    if (planned.size() < calib::kLeastCheckTouches) return all;
    for (const std::vector<calib::Touch>& touches : inputs_->checks_before) {
      if (all.size() == calib::kMostReferences) break;
      const auto ordered = in_order(touches);
      if (std::ranges::find(ordered, nullptr) != ordered.end()) continue;
      std::vector<calib::Touch> same;
      for (const std::size_t i : planned) same.push_back(*ordered[i]);
      if (calib::TcpChecker(round_.calibration(), same, all).judge(same).holds)
        all.push_back(std::move(same));
    }
    references_taken_ = all.size();
    return all;
  }

  std::shared_ptr<const TaskInputs> inputs_;
  PlannedRound round_;
  mutable std::size_t references_taken_ = 0;
};

}  // namespace

Tasks check_tasks(std::shared_ptr<const TaskInputs> inputs) {
  const auto round = std::make_shared<Round>(inputs);
  Tasks tasks;
  tasks.plan = [round] { return round->begin(); };
  tasks.choose = [round](const ChooseTouch& how, const std::vector<calib::Touch>& touches,
                         const calib::JointVector& from) {
    return round->choose(how, touches, from);
  };
  tasks.assess = [](const std::vector<calib::Touch>&) { return Tasks::Assessed{}; };
  tasks.identify = [round](const std::vector<calib::Touch>& touches) {
    return round->judge(touches);
  };
  tasks.report = [inputs, round](const SessionResult& result,
                                 const std::vector<calib::Touch>& touches) {
    const auto& check = std::get<calib::TcpCheck>(result.of);
    write_document(*inputs, result, touches, "check.json");
    inputs->note(fmt::format("check against session {} and {} checks before it: {}",
                             inputs->options.against, round->references_counted(),
                             calib::verdict_words(check)));
    if (const std::string change = calib::change_words(check); !change.empty())
      inputs->note(change);
    for (const calib::MasteredZero& zero : result.mastered)
      inputs->note(calib::words(phrase(zero)));
    if (!inputs->options.mastered.empty())
      inputs->note(fmt::format("check after mastering {}: {} touches, {:.1f} s planned",
                               fmt::join(inputs->options.mastered, ", "), check.touches,
                               round->planned_s()));
  };
  return tasks;
}

FoundSpheres found_spheres(const calib::Cell& cell, const std::vector<calib::Touch>& made,
                           const calib::PlanOptions& options) {
  const calib::Cell located = calib::Finder(cell, options, true, made).located();
  FoundSpheres all;
  for (std::size_t t = 0; t < cell.targets.size(); ++t) {
    const calib::Target& stated = cell.targets[t];
    if (stated.kind != calib::TargetKind::kSphere) continue;
    FoundSphere& sphere = all.spheres.emplace_back();
    sphere.target = stated.id;
    sphere.centre_m = located.targets[t].centre_m;
    if (stated.carried_by > 0) {
      sphere.on = cell.robot.positioner.at(static_cast<std::size_t>(stated.carried_by) - 1).name;
      sphere.taught_rad = located.targets[t].taught_rad;
    }
    sphere.u_m = 2.0 * calib::kFoundSigmaM;  // k = 2; criterion of the finder (finder.h)
    sphere.touches = static_cast<int>(std::ranges::count(made, stated.id, &calib::Touch::target));
    if (stated.has_centre) sphere.moved_m = (sphere.centre_m - stated.centre_m).norm();
  }
  return all;
}

Tasks find_tasks(Tasks tasks, std::shared_ptr<const TaskInputs> inputs) {
  tasks.assess = [](const std::vector<calib::Touch>&) { return Tasks::Assessed{}; };
  tasks.identify = [inputs](const std::vector<calib::Touch>& touches) {
    return SessionResult{found_spheres(inputs->cell, touches, inputs->options.plan)};
  };
  tasks.report = [inputs](const SessionResult& result, const std::vector<calib::Touch>& touches) {
    write_document(*inputs, result, touches, "found.json");
    for (const FoundSphere& one : std::get<FoundSpheres>(result.of).spheres)
      inputs->note("found " + calib::words(phrase(one)));
  };
  return tasks;
}

Tasks dry_run_tasks(std::shared_ptr<const TaskInputs> inputs) {
  const auto standoffs = std::make_shared<std::size_t>(0);
  Tasks tasks;
  tasks.plan = [inputs, standoffs] {
    Tasks::Planned planned = plan_beforehand(*inputs);
    *standoffs = planned.plan.touches.size();
    return planned;
  };
  tasks.assess = [](const std::vector<calib::Touch>&) { return Tasks::Assessed{}; };
  tasks.identify = [standoffs](const std::vector<calib::Touch>&) {
    return SessionResult{DryRun{*standoffs}};
  };
  tasks.report = [inputs](const SessionResult& result, const std::vector<calib::Touch>&) {
    inputs->note("dry run: " + calib::words(phrases(outcome_of(result)).front()));
  };
  return tasks;
}

namespace {

calib::Plan plan_of(const TaskInputs& inputs) {
  std::vector<double> speeds_m_s;
  for (const double share : kQualificationShares)
    speeds_m_s.push_back(share * inputs.options.touch.fast_m_s);
  return calib::make_qualification_plan(inputs.cell, inputs.options.plan, inputs.options.target,
                                        kQualificationPlaces, speeds_m_s);
}

/// The cell reduced to the touched sphere.
calib::Cell one_sphere(const calib::Cell& cell, const std::string& target) {
  calib::Cell part = cell;
  std::erase_if(part.targets, [&](const calib::Target& t) { return t.id != target; });
  part.lengths.clear();
  return part;
}

/// None: not determined by the few touches of one sphere.
std::optional<Figure> radius_offset(const TaskInputs& inputs,
                                    const std::vector<calib::Touch>& touches) try {
  if (touches.empty()) return std::nullopt;
  const calib::Calibration calibration =
      calib::identify_single_pass(one_sphere(inputs.cell, touches.front().target), touches);
  const calib::ParameterResult* rho =
      find(calibration, calib::tool_parameter(calib::ParameterKind::kEffectiveRadius, 0));
  if (rho == nullptr) return std::nullopt;
  return Figure{rho->correction, rho->sigma};
} catch (const calib::IdentifyError&) {
  return std::nullopt;
}

}  // namespace

Tasks qualification_tasks(std::shared_ptr<const TaskInputs> inputs) {
  const auto plan = std::make_shared<calib::Plan>();
  Tasks tasks;
  tasks.plan = [inputs, plan] {
    *plan = plan_of(*inputs);
    return Tasks::Planned{*plan, plan_hash(*plan), {}};
  };
  tasks.assess = [](const std::vector<calib::Touch>&) { return Tasks::Assessed{}; };
  tasks.identify = [inputs, plan](const std::vector<calib::Touch>& touches) {
    const calib::Cell& cell = inputs->cell;
    const StatedContact stated{cell.touch_sigma_m, cell.latch_delay_s, cell.latch_delay_sigma_s,
                               cell.radius_offset_sigma_m};
    return SessionResult{qualify(
        *plan, inputs->readings(), inputs->options.touch.fast_m_s, inputs->options.touch.slow_m_s,
        stated, radius_offset(*inputs, touches), inputs->options.touch.confirm_every <= 1)};
  };
  tasks.report = [inputs](const SessionResult& result, const std::vector<calib::Touch>& touches) {
    write_document(*inputs, result, touches, "qualification.json");
  };
  return tasks;
}

namespace {

calib::Calibration last_of(const TaskInputs& inputs) {
  if (!inputs.compared)
    throw calib::IdentifyError(
        calib::IdentifyError::Kind::kCalibration,
        "the calibration that this update is based on is no longer published. Run a full session: "
        "'cellcal run'");
  return calib::calibration_from_json(inputs.compared->calibration, inputs.compared->words);
}

/// Used by the worker only, job after job.
class Update {
 public:
  explicit Update(std::shared_ptr<const TaskInputs> inputs)
      : inputs_(std::move(inputs)), last_(last_of(*inputs_)), round_(inputs_, last_) {}

  Tasks::Planned begin() {
    round_.add(calib::make_check_plan(round_.calibration(), inputs_->options.plan,
                                      calib::first_update_touches()));
    return {{}, "", round_.progress()};
  }

  Tasks::Chosen choose(const ChooseTouch& how, const std::vector<calib::Touch>& touches,
                       const calib::JointVector& from) {
    round_.learn(how, touches);
    if (round_.all_done() && !further_) add_further(touches, from);
    Tasks::Chosen chosen = round_.offer(from);
    chosen.stage = further_ ? "resolving what changed" : "checking";
    return chosen;
  }

  calib::Calibration result(const std::vector<calib::Touch>& touches) const {
    return estimate_update(inputs_->files, touches, *inputs_->compared, inputs_->options.months,
                           not_found());
  }

 private:
  std::vector<std::string> not_found() const {
    std::vector<std::string> ids;
    for (std::size_t i = 0; i < round_.plan().touches.size(); ++i) {
      const std::string& id = round_.plan().touches[i].target;
      if (round_.became(i) == PlannedRound::Became::kMissed &&
          std::ranges::find(ids, id) == ids.end())
        ids.push_back(id);
    }
    return ids;
  }

  void add_further(const std::vector<calib::Touch>& touches, const calib::JointVector& from) {
    further_ = true;
    const calib::Calibration so_far = calib::update(
        last_, touches, {inputs_->compared->words, inputs_->options.months, not_found(), kPoses});
    const bool pays = not_found().empty() && touches.size() >= calib::kLeastUpdateTouches &&
                      calib::further_touches_pay(*so_far.update);
    if (!pays) return;
    calib::Pace pace;
    pace.predicted_m = calib::first_update_touches().before_m;
    auto how =
        calib::further_update_touches(static_cast<int>(touches.size()),
                                      calib::duration_s(round_.plan(), inputs_->cell.robot, pace));
    const auto& [arm_rad, positioner_rad] = parted(inputs_->cell.robot, from);
    how.positioner_rad = positioner_rad;
    if (how.most_touches < how.least_touches) return;
    const calib::Calibration known = round_.calibration();
    try {
      round_.know(so_far);
      round_.add(
          calib::make_update_plan(round_.calibration(), inputs_->options.plan, how, arm_rad));
    } catch (const calib::PlanError& error) {  // continues with the existing touches
      round_.know(known);
      inputs_->note(fmt::format("no further touches: {}", error.what()));
    }
  }

  static constexpr int kPoses = 60;  ///< as elsewhere in planning
  std::shared_ptr<const TaskInputs> inputs_;
  calib::Calibration last_;
  PlannedRound round_;
  bool further_ = false;
};

}  // namespace

Tasks update_tasks(std::shared_ptr<const TaskInputs> inputs) {
  const auto update = std::make_shared<Update>(inputs);
  Tasks tasks;
  tasks.plan = [update] { return update->begin(); };
  tasks.choose = [update](const ChooseTouch& how, const std::vector<calib::Touch>& touches,
                          const calib::JointVector& from) {
    return update->choose(how, touches, from);
  };
  tasks.assess = [](const std::vector<calib::Touch>&) { return Tasks::Assessed{}; };
  tasks.identify = [update](const std::vector<calib::Touch>& touches) {
    return SessionResult{update->result(touches)};
  };
  tasks.report = [inputs](const SessionResult& result, const std::vector<calib::Touch>& touches) {
    const calib::Calibration& calibration = *result.calibration();
    write_results(*inputs, calibration, touches, std::nullopt);
    for (const std::string& words : calib::words(calibration.verdict.findings)) inputs->note(words);
  };
  return tasks;
}

}  // namespace cellcal::daemon
