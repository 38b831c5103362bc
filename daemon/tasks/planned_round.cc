#include "daemon/tasks/planned_round.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

#include "calib/plan/check_plan.h"
#include "calib/plan/positioner_plan.h"
#include "daemon/files/atomic_file.h"
#include "daemon/tasks/active_calibration.h"
#include "daemon/tasks/options.h"

namespace cellcal::daemon {

namespace {

/// A touch matches a planned one if no axis is farther from the end of its line: a few centimetres.
constexpr double kOfItsLineRad = 0.08;
/// Occasional bad contacts are no change: retried once.
constexpr int kTries = 2;

double off_rad(const calib::JointVector& one, const calib::JointVector& other) {
  double most = 0.0;
  for (std::size_t i = 0; i < one.size(); ++i) most = std::max(most, std::abs(one[i] - other[i]));
  return most;
}

}  // namespace

PlannedRound::PlannedRound(std::shared_ptr<const TaskInputs> inputs,
                           const calib::Calibration& calibration)
    : inputs_(std::move(inputs)) {
  know(calibration);
}

void PlannedRound::know(const calib::Calibration& calibration) {
  calibration_ = calibration;
  calibration_.cell.obstacles = inputs_->cell.obstacles;
  calibration_.cell.floor_m = inputs_->cell.floor_m;
  calibration_.cell.passable = inputs_->cell.passable;
}

bool PlannedRound::all_done() const {
  return std::ranges::find(became_, Became::kOpen) == became_.end();
}

void PlannedRound::add(calib::Plan plan) {
  const std::size_t first = plan_.touches.size();
  // Checked first: a plan that is refused is not offered.
  if (!begin_.empty()) refuse_beyond_reach(*inputs_, plan, 0, begin_);
  if (first == 0) {
    plan_ = std::move(plan);
  } else {
    // Returns along the paths of both plans, where they join; otherwise the arm stays in place.
    const bool joins = !plan.home.empty() && plan.home.back() == plan_.touches.back().clear;
    if (joins) plan.home.insert(plan.home.end(), plan_.home.begin(), plan_.home.end());
    plan_.home = std::move(plan.home);
    for (calib::PlannedTouch& touch : plan.touches) plan_.touches.push_back(std::move(touch));
  }
  became_.resize(plan_.touches.size(), Became::kOpen);
  tries_.resize(plan_.touches.size(), 0);
  touch_of_.resize(plan_.touches.size());
}

void PlannedRound::learn(const ChooseTouch& how, const std::vector<calib::Touch>& touches) {
  if (in_hand_ && how.failed) {
    if (*how.failed == calib::NotMade::kMissed)
      became_[*in_hand_] = Became::kMissed;
    else if (++tries_[*in_hand_] == kTries)
      became_[*in_hand_] = Became::kSetAside;
  }
  for (; learnt_ < touches.size(); ++learnt_) {
    const auto planned = in_hand_ && !how.failed ? in_hand_ : planned_of(touches[learnt_]);
    if (!planned) continue;
    became_[*planned] = Became::kMade;
    touch_of_[*planned] = learnt_;
  }
  in_hand_.reset();
}

PartedAxes parted(const calib::Robot& robot, const calib::JointVector& all_rad) {
  const std::size_t joints = std::min(robot.joints.size(), all_rad.size());
  const auto arm_end = all_rad.begin() + static_cast<std::ptrdiff_t>(joints);
  return {{all_rad.begin(), arm_end}, calib::resting_at(robot, {arm_end, all_rad.end()})};
}

Tasks::Chosen PlannedRound::offer(const calib::JointVector& from, bool in_contact) {
  const auto& [arm_rad, positioner_rad] = parted(inputs_->cell.robot, from);
  if (begin_.empty()) {
    begin_ = arm_rad;
    refuse_beyond_reach(*inputs_, plan_, 0, begin_);
  }
  Tasks::Chosen chosen;
  const auto next = std::ranges::find(became_, Became::kOpen);
  if (next != became_.end()) {
    in_hand_ = static_cast<std::size_t>(next - became_.begin());
    chosen.plan.touches.push_back(calib::check_touch_from(calibration_, plan_, *in_hand_, arm_rad,
                                                          in_contact, positioner_rad));
    refuse_beyond_reach(*inputs_, chosen.plan, 0,
                        begin_);  // its path may differ from the planned one
  } else if (!plan_.touches.empty() && arm_rad == plan_.touches.back().clear) {
    chosen.plan.home = plan_.home;
    chosen.plan.home_rad = positioner_rad;
  }
  chosen.progress = progress();
  return chosen;
}

std::optional<std::size_t> PlannedRound::planned_of(const calib::Touch& touch) const {
  std::optional<std::size_t> nearest;
  double least = kOfItsLineRad;
  for (std::size_t i = 0; i < plan_.touches.size(); ++i) {
    if (plan_.touches[i].target != touch.target) continue;
    const double off = off_rad(plan_.touches[i].end, touch.joint_rad);
    if (off >= least) continue;
    least = off;
    nearest = i;
  }
  return nearest;
}

calib::Progress PlannedRound::progress() const {
  calib::Progress progress;
  progress.touches = static_cast<int>(std::ranges::count(became_, Became::kMade));
  progress.checks_left = static_cast<int>(std::ranges::count(became_, Became::kOpen));
  progress.fitted = true;
  progress.done = progress.checks_left == 0;
  return progress;
}

SessionRecord published_session(Journal& journal, const std::filesystem::path& cell,
                                std::optional<std::int64_t> session) {
  std::optional<Published> found;
  try {
    found = session ? usable(journal, *session) : active_calibration(journal, cell.string());
  } catch (const NotUsable& none) {
    using Why = NotUsable::Why;
    if (none.why != Why::kNoSession && none.why != Why::kWithheld) throw;
  }
  if (found && (cell.empty() || found->record.inputs.cell_name == cell.string()))
    return std::move(found->record);
  if (session)
    throw NothingToCheck(
        fmt::format("session {} has no published calibration{}. See 'cellcal history'", *session,
                    cell.empty() ? "" : " of " + cell.string()));
  throw NothingToCheck(fmt::format(
      "no published calibration{}: nothing to check. Calibrate first: 'cellcal run --cell {}'",
      cell.empty() ? "" : " of " + cell.string(),
      cell.empty() ? "CELL" : shell_word(cell.string())));
}

calib::Calibration calibration_of(Journal& journal, std::int64_t session) {
  return published_or_refused(journal, session).calibration;
}

std::vector<std::vector<calib::Touch>> checks_before(Journal& journal, std::int64_t calibrated,
                                                     std::int64_t before, const std::string& load) {
  std::vector<std::vector<calib::Touch>> checks;
  for (const SessionRecord& record : journal.sessions()) {
    if (record.id >= before || record.id <= calibrated || record.state != RecordState::kDone ||
        record.origin)
      continue;
    try {
      const SessionOptions options = options_from_json(record.inputs.options);
      if (options.kind != SessionKind::kCheck || options.against != calibrated ||
          options.load != load || !options.mastered.empty())
        continue;
      checks.push_back(journal.touches(record.id));
    } catch (const std::runtime_error& error) {
      spdlog::warn("check {} is not referred to: {}", record.id, error.what());
    }
  }
  std::ranges::reverse(checks);
  return checks;
}

std::optional<Compared> last_calibration(Journal& journal, const std::string& cell_name,
                                         std::int64_t before, bool accepted) {
  const auto found = in_use(journal, cell_name, before);
  if (!found) return std::nullopt;
  if (!found->calibration && accepted) {
    spdlog::warn("not compared: {}", found->trouble);
    return std::nullopt;
  }
  if (!found->calibration) throw NotUsable(NotUsable::Why::kDamaged, found->trouble);
  const auto& active = found->calibration;
  constexpr std::size_t kDate = 10;  // YYYY-MM-DD
  const SessionRecord& record = active->record;
  return Compared{fmt::format("session {} of {}", record.id, record.ended.substr(0, kDate)),
                  accepted, record.calibration};
}

std::string compared_to_json(const Compared& compared) {
  return nlohmann::json{{"words", compared.words},
                        {"accepted", compared.accepted},
                        {"calibration", compared.calibration}}
             .dump() +
         "\n";
}

Compared compared_from_json(const std::string& text) {
  try {
    const nlohmann::json json = nlohmann::json::parse(text);
    return {json.at("words"), json.at("accepted"), json.at("calibration")};
  } catch (const nlohmann::json::exception&) {
    throw std::runtime_error(
        "compared.json: damaged: words, accepted and calibration are needed. Export the session again");
  }
}

}  // namespace cellcal::daemon
