#include "calib/plan/plan.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "calib/files/files.h"
#include "calib/files/input_file.h"
#include "calib/files/toml.h"
#include "calib/files/touches.h"
#include "calib/model/error.h"
#include "calib/model/long_work.h"
#include "calib/model/units.h"
#include "calib/plan/candidates.h"
#include "calib/plan/cell_check.h"
#include "calib/plan/design.h"
#include "calib/plan/duration.h"
#include "calib/plan/lowest.h"
#include "daemon/cli/commands.h"
#include "daemon/cli/correct.h"
#include "daemon/cli/offline.h"
#include "daemon/files/correction_limit.h"
#include "daemon/report/plan_picture.h"

namespace cellcal::daemon {

namespace {

/// Progress of planning, on a terminal only. Ctrl-C ends the program as usual.
class PercentOnTerminal {
 public:
  ~PercentOnTerminal() {
    if (terminal_) std::fputs("\r\033[K", stderr);
  }
  void show(const calib::WorkDone& done) const {
    if (terminal_) fmt::print(stderr, "\rplanning {:.0f} %", 100.0 * done.share);
  }

 private:
  bool terminal_ = ::isatty(STDERR_FILENO) == 1;
};

/// The touch of an exactly nominal arm and cell.
calib::Touch nominal_touch(const calib::PlannedTouch& planned) {
  calib::Touch touch;
  touch.target = planned.target;
  touch.set = planned.set;
  touch.positioner_rad = planned.positioner_rad;
  const double fraction = planned.expected_m / planned.search_m;
  for (std::size_t i = 0; i < planned.standoff.size(); ++i) {
    touch.joint_rad.push_back(planned.standoff[i] +
                              fraction * (planned.end[i] - planned.standoff[i]));
  }
  return touch;
}

/// At the axis speeds of the robot file.
double minutes(const calib::Plan& plan, const calib::Robot& robot) {
  return calib::duration_s(plan, robot, {}) / 60.0;
}

/// Current position of the arm, or the plan's preferred start.
calib::JointVector begin_of(const PlanCommand& command, const calib::Robot& robot) {
  calib::JointVector begin;
  const std::size_t stated = command.from_deg.size();
  if (stated > 0 && stated != robot.joints.size())
    throw std::runtime_error(fmt::format("--from: {0} angles, {2} joints in {1}", stated,
                                         robot.name, robot.joints.size()));
  for (std::size_t i = 0; i < stated; ++i) {
    begin.push_back(calib::joint_si(robot.joints[i], command.from_deg[i]));
    if (begin[i] < robot.joints[i].min_rad || begin[i] > robot.joints[i].max_rad)
      throw std::runtime_error(fmt::format("--from: {1:g} {2} for {0} is outside of its limits",
                                           robot.joints[i].name, command.from_deg[i],
                                           unit_of(robot.joints[i]).name));
  }
  return begin;
}

/// The points of the programs. Throws FileError if too few are known, and for a name of --leave without a point in any
/// of them.
calib::AccuracyRegion region_of_programs(const PlanCommand& command, const calib::Cell& cell) {
  calib::AccuracyRegion region{calib::AccuracyRegion::Kind::kPostures};
  const std::vector<std::string> leave = upper(command.leave), still = upper(command.still);
  std::map<std::string, std::size_t> programs_without;
  for (const std::filesystem::path& program : command.programs) {
    const krl::ProgramPostures found = krl::program_postures(
        cell, read_program_files(program, {}, command.controller), leave, still);
    for (const auto& [name, error] : found.no_points)
      if (++programs_without[name] == command.programs.size()) throw error;
    region.postures.insert(region.postures.end(), found.postures.begin(), found.postures.end());
    for (const krl::Refusal& one : found.refusals) warn(krl::phrase(one, cell.robot));
  }
  if (region.postures.size() < calib::AccuracyRegion::kFewestPostures)
    throw calib::FileError(fmt::format(
        "--program: {} points with known tool, base and posture; at least {} are needed",
        region.postures.size(), calib::AccuracyRegion::kFewestPostures));
  return region;
}

calib::Phrase region_phrase(const PlanCommand& command) {
  return command.programs.empty() ? calib::Phrase(command.region) : "say.plan.programs";
}

calib::Phrase foreseen(const calib::Phrase& region, const calib::Plan& plan,
                       const calib::Robot& robot) {
  return {plan.predicted_u95_m > 0.0 ? "say.plan.foreseen" : "say.plan.foreseen.mean",
          {{"region", region},
           {"mean", plan.predicted_mean_m * calib::kMmPerM},
           {"u95", plan.predicted_u95_m * calib::kMmPerM},
           {"min", minutes(plan, robot)}}};
}

/// Why the goal is missed with all touches that were allowed; none where it is reached.
std::optional<calib::Phrase> missed(const PlanCommand& command, const calib::Plan& plan) {
  if (!plan.missing) return std::nullopt;
  return calib::Phrase{"say.plan.goal.missed",
                       {{"u95", plan.predicted_u95_m * calib::kMmPerM},
                        {"n", command.touches},
                        {"goal", *command.goal_mm},
                        {"what", phrase_of(*plan.missing)}}};
}

nlohmann::json json_of(const calib::Missing& missing) {
  nlohmann::json json{{"source", to_string(missing.source)}, {"share", missing.share}};
  if (missing.joint.empty()) return json;
  json["joint"] = missing.joint;
  if (missing.source != calib::UncertaintySource::kTransmission) return json;
  json["angle_deg"] = {missing.from_rad * calib::kDegPerRad, missing.to_rad * calib::kDegPerRad};
  return json;
}

calib::Phrase travel(const LimitNeeded& needed, const calib::Plan& plan,
                     const calib::Robot& robot) {
  std::string begin;
  for (std::size_t i = 0; i < robot.joints.size(); ++i)
    begin +=
        fmt::format("{}{:.0f}", i == 0 ? "" : ",", plan.start[i] * unit_of(robot.joints[i]).per_si);
  if (robot.first_turning() > 0) return {"say.plan.begin", {{"begin", begin}}};
  return {"say.plan.travel",
          {{"axis", needed.axis},
           {"deg", needed.turn_deg},
           {"begin", begin},
           {"limit", needed.limit_deg},
           {"anywhere", std::min(needed.anywhere_deg, kWidestLimitDeg)}}};
}

nlohmann::json json_of(const calib::Plan& plan, const calib::Robot& robot,
                       const LimitNeeded& needed) {
  nlohmann::json list = nlohmann::json::array();
  for (const calib::PlannedTouch& planned : plan.touches) {
    nlohmann::json joints, tracks;
    const calib::Touch touch = nominal_touch(planned);
    for (std::size_t i = 0; i < robot.joints.size(); ++i) {
      const calib::Joint& joint = robot.joints[i];
      (joint.is_prismatic() ? tracks : joints)[joint.name] =
          touch.joint_rad[i] * unit_of(joint).per_si;
    }
    list.push_back({{"target", planned.target},
                    {"set", to_string(planned.set)},
                    {"joints_deg", joints},
                    {"normal", {planned.normal.x(), planned.normal.y(), planned.normal.z()}},
                    {"search_mm", planned.search_m * calib::kMmPerM}});
    if (!tracks.is_null()) list.back()["joints_mm"] = tracks;
    for (std::size_t j = 0; j < planned.positioner_rad.size(); ++j)
      list.back()["positioner_deg"][robot.positioner[j].name] =
          planned.positioner_rad[j] * calib::kDegPerRad;
  }
  return {{"touches", list},
          {"left_out", plan.left_out},
          {"predicted_m3_mm", plan.predicted_mean_m * calib::kMmPerM},
          {"predicted_u95_mm", plan.predicted_u95_m > 0.0
                                   ? nlohmann::json(plan.predicted_u95_m * calib::kMmPerM)
                                   : nlohmann::json(nullptr)},
          {"farthest_turn_deg", needed.turn_deg},
          {"correction_limit_deg", needed.limit_deg},
          {"correction_limit_anywhere_deg", needed.anywhere_deg},
          {"robot_minutes", minutes(plan, robot)}};
}

std::string left_out_comment(const calib::Plan& plan, const calib::Cell& cell) {
  std::string lines;
  for (const std::string& id : plan.left_out) {
    const auto why = calib::why_not_planned(cell.targets[cell.target_index(id)]);
    lines += "# left out: " + id + ", " + (why ? calib::words(*why) : "") + "\n";
  }
  return lines;
}

using calib::kMmPerM;

/// Plan of the cell as its file states it; none where it cannot be planned, which is reported.
std::optional<calib::Plan> plan_of_today(const calib::Cell& cell,
                                         const calib::PlanOptions& options) try {
  return calib::make_plan(cell, options);
} catch (const calib::PlanError& error) {
  fmt::print(stderr, "warning: no plan with today's spheres to compare with: {}\n", error.what());
  return std::nullopt;
}

calib::Phrase accuracy_of(const calib::Plan& plan) {
  return {"say.plan.accuracy",
          {{"mean", plan.predicted_mean_m * kMmPerM}, {"u95", plan.predicted_u95_m * kMmPerM}}};
}

std::vector<calib::Target> spheres_of(const calib::Cell& cell) {
  std::vector<calib::Target> spheres = cell.targets;
  std::erase_if(spheres, [](const auto& one) { return one.kind != calib::TargetKind::kSphere; });
  return spheres;
}

std::string toml_value(const nlohmann::json& value) {
  if (value.is_string()) return calib::toml_string(value.get<std::string>());
  return value.is_number() ? calib::toml_number(value.get<double>()) : value.dump();
}

/// As lines of a cell file: of a sphere that `file` has, all that does not state its place stays.
std::string file_lines(const calib::Cell& cell, const nlohmann::json& file) {
  std::string lines;
  for (const calib::Target& target : spheres_of(cell)) {
    nlohmann::json sphere{{"kind", "sphere"}, {"diameter_mm", target.diameter_m * kMmPerM}};
    for (const nlohmann::json& own : file.at("target"))
      if (own.at("id") == target.id) sphere = own;
    for (const char* key :
         {"id", "centre_mm", "centre_sigma_mm", "search_low_mm", "search_high_mm"})
      sphere.erase(key);
    lines += "\n[[target]]\nid = " + calib::toml_string(target.id) + "\n";
    for (const auto& [key, value] : sphere.items()) lines += key + " = " + toml_value(value) + "\n";
    lines += fmt::format("centre_mm = [{:.0f}, {:.0f}, {:.0f}]\ncentre_sigma_mm = {:g}\n",
                         target.centre_m.x() * kMmPerM, target.centre_m.y() * kMmPerM,
                         target.centre_m.z() * kMmPerM, target.centre_sigma_m * kMmPerM);
  }
  return lines;
}

nlohmann::json accuracy_json(const calib::Plan& plan) {
  return {{"predicted_m3_mm", plan.predicted_mean_m * kMmPerM},
          {"predicted_u95_mm", plan.predicted_u95_m * kMmPerM}};
}

std::string json_of(const calib::SuggestedSpheres& suggested,
                    const std::optional<calib::Plan>& today) {
  nlohmann::json value = accuracy_json(suggested.plan);
  value["today"] = today ? accuracy_json(*today) : nlohmann::json(nullptr);
  for (const calib::Target& target : spheres_of(suggested.cell))
    value["spheres"].push_back({{"id", target.id},
                                {"diameter_mm", target.diameter_m * kMmPerM},
                                {"centre_mm",
                                 {target.centre_m.x() * kMmPerM, target.centre_m.y() * kMmPerM,
                                  target.centre_m.z() * kMmPerM}}});
  return value.dump(1) + "\n";
}

}  // namespace

int plan(const PlanCommand& command) {
  calib::Cell cell = calib::load_cell(command.cell);
  if (!command.last.empty())
    cell = with_functions_of(read_calibration(command.last).cell.robot, std::move(cell));
  for (const calib::Phrase& warning : calib::refuse_faulty(cell)) warn(warning);
  calib::PlanOptions options;
  options.fit_touches = command.touches;
  options.check_touches = command.check;
  options.goal_u95_m = command.goal_mm.value_or(0.0) / calib::kMmPerM;
  options.seed = command.seed;
  options.region = command.programs.empty() ? calib::parse_accuracy_region(command.region)
                                            : region_of_programs(command, cell);
  if (command.suggest_spheres > 0) return suggest_spheres(command, cell, options);
  const calib::Plan made = [&] {
    const PercentOnTerminal percent;
    const calib::Watch watch([] { return false; },
                             [&](const calib::WorkDone& done) { percent.show(done); });
    return calib::make_plan(cell, options, begin_of(command, cell.robot));
  }();
  if (const auto fault = calib::fault_of(cell, made)) warn(phrase(*fault));
  if (const auto low = calib::below_feet(cell, made)) warn(phrase(*low));
  const auto short_of = missed(command, made);
  if (short_of) warn(*short_of);
  const LimitNeeded needed = limit_needed(made, cell.robot, made.start);
  if (!command.picture.empty()) put(plan_svg(cell, made), command.picture);
  if (command.json) {
    nlohmann::json json = json_of(made, cell.robot, needed);
    if (command.goal_mm) json["goal_mm"] = *command.goal_mm;
    if (made.missing) json["missing"] = json_of(*made.missing);
    put(json.dump(1) + "\n", command.output);
    return kSuccess;
  }
  std::vector<calib::Touch> touches;
  for (const calib::PlannedTouch& planned : made.touches) touches.push_back(nominal_touch(planned));
  const calib::Phrase accuracy = foreseen(region_phrase(command), made, cell.robot),
                      turn = travel(needed, made, cell.robot);
  put_as([&](const auto& text, const auto& name) { calib::parse_touches(text, name, cell); },
         "# planned with nominal geometry, not measured\n" + left_out_comment(made, cell) + "# " +
             words(accuracy) + "\n# " + words(turn) + "\n" +
             (short_of ? "# " + words(*short_of) + "\n" : "") +
             calib::format_touches(touches, cell.robot),
         command.output);
  if (!command.output.empty())
    put(fmt::format("{}\n{}\n{}\n",
                    say({"say.plan.written",
                         {{"file", command.output.string()}, {"n", made.touches.size()}}}),
                    say(accuracy), say(turn)),
        {});
  return kSuccess;
}

int suggest_spheres(const PlanCommand& command, const calib::Cell& cell,
                    const calib::PlanOptions& options) {
  const calib::SuggestedSpheres suggested =
      calib::suggest_spheres(cell, options, command.suggest_spheres);
  const std::optional<calib::Plan> today = plan_of_today(cell, options);
  if (!command.picture.empty()) put(plan_svg(suggested.cell, suggested.plan), command.picture);
  if (command.json) {
    put(json_of(suggested, today), command.output);
    return kSuccess;
  }
  const bool gains = !today || suggested.plan.predicted_mean_m < today->predicted_mean_m;
  std::vector<calib::Phrase> lines{{"say.plan.suggested",
                                    {{"accuracy", accuracy_of(suggested.plan)},
                                     {"touches", command.touches},
                                     {"region", region_phrase(command)},
                                     {"spheres", spheres_of(suggested.cell).size()}}}};
  if (today)
    lines.push_back(
        {gains ? "say.plan.today" : "say.plan.today.as_good", {{"accuracy", accuracy_of(*today)}}});
  lines.push_back(
      {"say.plan.suggested.do", {{"mm", suggested.cell.targets.front().centre_sigma_m * kMmPerM}}});
  std::string in_file, on_terminal;
  for (const calib::Phrase& line : lines) {
    in_file += "# " + words(line) + "\n";
    on_terminal += "# " + said(line);
  }
  put(in_file + file_lines(suggested.cell, calib::toml_to_json(calib::read_file(command.cell))),
      command.output);
  if (!command.output.empty()) put(on_terminal, {});
  return kSuccess;
}

}  // namespace cellcal::daemon
