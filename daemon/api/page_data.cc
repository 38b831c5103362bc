// Data of the page's drawings: the cell, the planned touches and their results.

#include "daemon/api/page_data.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>

#include "calib/files/calibration_json.h"
#include "calib/files/files.h"
#include "calib/model/error.h"
#include "calib/model/kinematics.h"
#include "calib/model/units.h"
#include "calib/plan/bodies.h"
#include "calib/plan/positioner_plan.h"
#include "calib/plan/surroundings.h"
#include "calib/result/finding_phrase.h"
#include "daemon/api/handlers.h"
#include "daemon/result/outcome_json.h"
#include "daemon/tasks/options.h"

namespace cellcal::daemon {

namespace {

/// Session of the drawing: `?session=N`, otherwise the newest. 0: none.
std::int64_t session_asked_for(const Request& request, const Status& status, Journal& journal) {
  if (const auto asked = whole_number_in(request, "session")) return *asked;
  if (status.session > 0) return status.session;
  const auto all = journal.sessions();
  return all.empty() ? 0 : all.front().id;
}

/// Includes meshes whose files still exist at their place in the cell file.
calib::Cell drawn_cell(const SessionInputs& inputs) {
  calib::Cell cell = cell_of(inputs);
  try {
    calib::load_meshes(cell, std::filesystem::path(inputs.cell_name).parent_path());
  } catch (const calib::FileError& missing) {
    spdlog::warn("drawn without meshes: {}", missing.what());
  }
  return cell;
}

std::optional<calib::Calibration> calibration_of(const SessionRecord& record) {
  if (record.calibration.empty()) return std::nullopt;
  try {
    return calib::calibration_from_json(record.calibration, "session " + std::to_string(record.id));
  } catch (const std::runtime_error& other_version) {
    spdlog::warn("not shown: {}", other_version.what());
    return std::nullopt;
  }
}

Answer scene(Api& api, const Call& call) {
  const std::int64_t id = session_asked_for(call.request, api.service.status(), api.journal);
  const auto record = id > 0 ? api.journal.session(id) : std::nullopt;
  if (!record) throw NotFound("no such session, so no cell to draw. Start one: cellcal run");
  return Response{.body = web::scene_to_json(id, drawn_cell(record->inputs))};
}

/// For the cell of `?session=N`, otherwise of the newest session with a result.
Answer drift(Api& api, const Call& call) {
  const auto id = whole_number_in(call.request, "session");
  const auto asked = id ? api.journal.session(*id) : std::nullopt;
  const auto calibration = [&api](std::int64_t session) {
    const auto record = api.journal.session(session);
    return record ? calibration_of(*record) : std::nullopt;
  };
  std::vector<SessionRecord> sessions = api.journal.sessions();
  // An imported session may name the same path for another cell.
  std::erase_if(sessions, [](const SessionRecord& record) {
    return record.origin.has_value() || !record.has_calibration;
  });
  const std::string cell = asked ? asked->inputs.cell_name : "";
  const auto checks = api.drift_watch.evaluate(cell);
  return Response{.body = web::drift_to_json(sessions, cell, calibration, checks.get(),
                                             api.advice ? api.advice() : AdviceStatus(),
                                             language_in(call.request))};
}

Answer plan(Api& api, const Call& call) {
  const SessionRecord record = find_session(api, call);
  const CurrentPlan current_index = api.service.plan();
  if (current_index.session != record.id || current_index.plan == nullptr) {
    throw NotFound("the plan of session " + std::to_string(record.id) +
                   " is not in memory: it is kept while the session is the newest of this daemon");
  }
  return Response{.body = web::plan_to_json(record.id, current_index.first, *current_index.plan,
                                            cell_of(record.inputs))};
}

Answer figures(Api& api, const Call& call) {
  const SessionRecord record = find_session(api, call);
  const auto calibration = calibration_of(record);
  std::map<std::size_t, web::FigureOfTouch> made;
  for (const auto& touch : api.service.made(record.id))
    made[touch->index] = {touch->residual_m, touch->u95_m};
  return Response{.body = web::figures_to_json(
                      record, cell_of(record.inputs), api.journal.touches(record.id),
                      calibration ? &*calibration : nullptr, made, language_in(call.request))};
}

}  // namespace

std::span<const Api::Route> drawing_routes() {
  static constexpr Api::Route kRoutes[] = {
      {"GET", "/v1/scene", Role::kView, kSlow, scene},
      {"GET", "/v1/drift", Role::kView, kSlow, drift},
      {"GET", "/v1/sessions/{id}/plan", Role::kView, kSlow, plan},
      {"GET", "/v1/sessions/{id}/figures", Role::kView, kSlow, figures},
  };
  return kRoutes;
}

}  // namespace cellcal::daemon

namespace cellcal::daemon::web {

using nlohmann::json;

namespace {

using calib::kMmPerM;
using Eigen::Vector3d;

/// The calibrated arm.
class FoundArm {
 public:
  explicit FoundArm(const calib::Calibration& found)
      : found_(found),
        arm_(calib::at_level(found.cell, found.level)),
        x_(calib::arm_values(arm_, found)),
        delay_s_(found.cell.latch_delay_s) {
    if (const calib::ParameterResult* delay = calib::find(found, calib::latch_delay_parameter()))
      delay_s_ = delay->nominal + delay->correction;
  }

  std::optional<double> residual_m(const calib::Touch& touch) const {
    const auto target = std::find_if(found_.targets.begin(), found_.targets.end(),
                                     [&](const auto& one) { return one.id == touch.target; });
    // The effective radius belongs to the first tool.
    const auto stated = std::ranges::find(found_.cell.targets, touch.target, &calib::Target::id);
    if (target == found_.targets.end() || stated == found_.cell.targets.end() ||
        !touch.tool.empty() || touch.positioner_rad.size() != found_.cell.robot.positioner.size())
      return std::nullopt;
    // The centre, too, is in the frame that carries the target.
    const Vector3d tip = arm_.position(pose_of(arm_, touch, *stated), x_.data());
    Vector3d outwards = target->normal;
    double distance = outwards.dot(tip - target->centre_m);
    if (target->kind == calib::TargetKind::kSphere) {
      outwards = (tip - target->centre_m).normalized();
      distance = (tip - target->centre_m).norm();
    } else if (target->kind != calib::TargetKind::kPlane) {
      return std::nullopt;
    }
    double closing = touch.speed_m_s;
    if (touch.approach)
      closing *= -(carried_at(found_.cell.robot, carrier_rad(touch, *stated)).linear().transpose() *
                   Vector3d(touch.approach->data()))
                      .dot(outwards);
    return distance - target->effective_radius_m + closing * delay_s_;
  }

 private:
  const calib::Calibration& found_;
  calib::ArmModel arm_;
  Eigen::VectorXd x_;
  double delay_s_;
};

void add_positioner(const std::vector<double>& angles_rad, json& value) {
  for (const double angle : angles_rad)
    value["positioner_deg"].push_back(number(angle, calib::kDegPerRad));
}

json touch_to_json(std::size_t index, const calib::Touch& touch, const calib::ArmModel& nominal,
                   const std::optional<FoundArm>& found, const FigureOfTouch& made) {
  const auto residual = found ? found->residual_m(touch) : made.residual_m;
  json value{{"index", index},
             {"target", touch.target},
             {"set", to_string(touch.set)},
             {"joints_deg", shown_joints(touch.joint_rad, nominal.robot())},
             {"tip_mm", mm(nominal.nominal_tip_m(touch.joint_rad))},
             {"residual_mm", residual ? number(*residual, kMmPerM) : json(nullptr)},
             {"u95_mm", made.u95_m ? number(*made.u95_m, kMmPerM) : json(nullptr)}};
  add_positioner(touch.positioner_rad, value);
  return value;
}

json summary(const calib::ResidualSummary& of) {
  return {{"touches", of.count},
          {"mean_mm", number(of.mean_m, kMmPerM)},
          {"max_mm", number(of.max_m, kMmPerM)},
          {"rms_mm", number(of.rms_m, kMmPerM)}};
}

/// Subject as a name ("S1", "S1-S2"), and the touch from which it applies, counted from 1.
json about_to_json(const calib::Subject& about) {
  const bool length = about.of == calib::Subject::Of::kLength;
  return {{"of", calib::to_string(about.of)},
          {"name", length ? about.name + "-" + about.other_end : about.name},
          {"touch", about.touch ? json(*about.touch + 1) : json(nullptr)}};
}

json evidence_to_json(const std::vector<calib::Quantity>& evidence) {
  json list = json::array();
  for (const calib::Quantity& one : evidence)
    list.push_back({{"name", one.name},
                    {"value", number(one.value)},
                    {"unit", one.unit},
                    {"sigma", number(one.sigma)}});
  return list;
}

json parts_to_json(const std::vector<calib::FindingPart>& parts) {
  constexpr std::size_t kMostParts = 8;  // the page displays at most this number
  json list = json::array();
  for (const calib::FindingPart& one : parts) {
    if (list.size() == kMostParts) break;
    list.push_back(
        {{"about", about_to_json(one.about)}, {"evidence", evidence_to_json(one.evidence)}});
  }
  return list;
}

json findings_to_json(const std::vector<calib::Finding>& findings,
                      const calib::Language& language) {
  json list = json::array();
  for (const calib::Finding& finding : findings) {
    // Such an update withholds nothing: the calibration in use holds.
    const bool holds = finding.kind == calib::FindingKind::kUpdateNotNeeded;
    list.push_back(
        {{"kind", calib::to_string(finding.kind)},
         {"severity", calib::to_string(holds ? calib::Severity::kInforms : finding.severity)},
         {"cause", finding.cause ? json(calib::to_string(*finding.cause)) : json(nullptr)},
         {"about", about_to_json(finding.about)},
         {"evidence", evidence_to_json(finding.evidence)},
         {"parts", parts_to_json(finding.parts)},
         {"words", calib::words(calib::phrase(finding), language)}});
  }
  return list;
}

json result_to_json(const calib::Calibration& found, const calib::Language& language) {
  // Files of an earlier version contain the value predicted from the tolerances there, and no U.
  const bool stated = found.nominal_workspace_u_m > 0.0;
  return {{"publish", found.verdict.publish()},
          {"scope", found.verdict.workspace ? "workspace" : "near targets"},
          {"findings", findings_to_json(found.verdict.findings, language)},
          {"before", summary(found.before)},
          {"after", summary(found.after)},
          {"check", summary(found.check)},
          {"near_targets_mm", number(found.predicted_near_targets_m, kMmPerM)},
          {"workspace_mm", number(found.predicted_workspace_m, kMmPerM)},
          {"nominal_workspace_mm", number(stated ? found.nominal_workspace_m : 0.0, kMmPerM)},
          {"nominal_workspace_u_mm", number(found.nominal_workspace_u_m, kMmPerM)}};
}

Eigen::Isometry3d after_turn(const calib::Joint& joint) {
  using Eigen::AngleAxisd, Eigen::Vector3d;
  Eigen::Isometry3d fixed = Eigen::Isometry3d::Identity();
  fixed.translate(Vector3d(joint.a_m, 0.0, joint.d_m));
  fixed.rotate(AngleAxisd(joint.alpha_rad, Vector3d::UnitX()));
  fixed.rotate(AngleAxisd(joint.beta_rad, Vector3d::UnitY()));
  return fixed;
}

json joint_to_json(const calib::Joint& joint, double assumed_m) {
  const double per_si = calib::unit_of(joint).per_si;
  const auto along = [&] {
    return std::vector(joint.guide->along.begin(), joint.guide->along.end());
  };
  return {{"name", joint.name},
          {"sign", joint.sign},
          {"offset_deg", number(joint.offset_rad, calib::kDegPerRad)},
          {"min_deg", number(joint.min_rad, per_si)},
          {"max_deg", number(joint.max_rad, per_si)},
          {"along", joint.is_prismatic() ? json(along()) : json(nullptr)},
          {"behind", frame(after_turn(joint))},
          {"radius_mm", number(joint.radius_m > 0.0 ? joint.radius_m : assumed_m, kMmPerM)}};
}

json joints_to_json(const calib::Robot& robot) {
  json list = json::array();
  const double assumed_m = calib::assumed_radius_m(robot);
  for (const calib::Joint& joint : robot.joints) list.push_back(joint_to_json(joint, assumed_m));
  return list;
}

json target_to_json(const calib::Target& target) {
  json value{{"id", target.id},
             {"kind", calib::to_string(target.kind)},
             {"diameter_mm", number(target.diameter_m, kMmPerM)},
             {"centre_mm", nullptr},
             {"box_mm", nullptr}};
  if (target.has_centre) value["centre_mm"] = mm(target.centre_m);
  if (target.has_box) value["box_mm"] = {mm(target.low_m), mm(target.high_m)};
  return value;
}

/// The axis by whose number of axes something is carried.
void add_carrier(const calib::Robot& robot, int carried_by, json& value) {
  if (carried_by > 0) value["on"] = robot.positioner[static_cast<std::size_t>(carried_by) - 1].name;
}

/// `still`: the cell with its positioner at 0.
json targets_to_json(const calib::Cell& cell, const calib::Cell& still) {
  json list = json::array();
  for (std::size_t t = 0; t < cell.targets.size(); ++t) {
    list.push_back(target_to_json(still.targets[t]));
    add_carrier(cell.robot, cell.targets[t].carried_by, list.back());
  }
  return list;
}

json positioner_to_json(const calib::Robot& robot) {
  json list = json::array();
  for (const calib::PositionerAxis& axis : robot.positioner) {
    const Eigen::Isometry3d at_zero =
        calib::carried_at(robot, std::vector<double>(list.size(), 0.0)) * axis.frame;
    list.push_back({{"name", axis.name}, {"sign", axis.sign}, {"frame", frame(at_zero)}});
  }
  return list;
}

json cylinder(const std::string& id, const Eigen::Isometry3d& at, double diameter_m,
              double height_m) {
  return {{"id", id},
          {"shape", "cylinder"},
          {"frame", frame(at)},
          {"diameter_mm", number(diameter_m, kMmPerM)},
          {"height_mm", number(height_m, kMmPerM)}};
}

json box(const std::string& id, const Eigen::Isometry3d& at, const Eigen::Vector3d& size_m) {
  return {{"id", id}, {"shape", "box"}, {"frame", frame(at)}, {"size_mm", mm(size_m)}};
}

json box_around(const calib::Obstacle& obstacle) {
  Eigen::AlignedBox3d around;
  for (const Eigen::Vector3d& vertex : obstacle.mesh->vertices_m) around.extend(vertex);
  return box(obstacle.id, obstacle.frame * Eigen::Translation3d(around.center()), around.sizes());
}

json mesh(const calib::Obstacle& obstacle) {
  json vertices = json::array(), triangles = json::array();
  for (const Eigen::Vector3d& vertex : obstacle.mesh->vertices_m)
    for (const double value : vertex) vertices.push_back(number(value, kMmPerM));
  for (const auto& triangle : obstacle.mesh->triangles)
    for (const int corner : triangle) triangles.push_back(corner);
  return {{"id", obstacle.id},
          {"shape", "mesh"},
          {"frame", frame(obstacle.frame)},
          {"vertices_mm", std::move(vertices)},
          {"triangles", std::move(triangles)}};
}

json obstacle_to_json(const calib::Obstacle& obstacle) {
  switch (obstacle.shape) {
    case calib::ObstacleShape::kBox: return box(obstacle.id, obstacle.frame, obstacle.size_m);
    case calib::ObstacleShape::kCylinder:
      return cylinder(obstacle.id, obstacle.frame, obstacle.diameter_m, obstacle.height_m);
    case calib::ObstacleShape::kMesh: break;
  }
  const bool empty = obstacle.mesh == nullptr || obstacle.mesh->vertices_m.empty();
  if (empty) return {{"id", obstacle.id}, {"shape", "unknown"}};
  return obstacle.mesh->triangles.size() > kMostTrianglesDrawn ? box_around(obstacle)
                                                               : mesh(obstacle);
}

json obstacles_to_json(const calib::Cell& cell, const calib::Cell& still) {
  json list = json::array();
  for (std::size_t i = 0; i < cell.obstacles.size(); ++i) {
    list.push_back(obstacle_to_json(still.obstacles[i]));
    add_carrier(cell.robot, cell.obstacles[i].carried_by, list.back());
  }
  return list;
}

json stands_to_json(const calib::Cell& cell, const calib::Cell& still) {
  json list = json::array();
  for (const calib::Post& post : calib::posts_of(still)) {
    const calib::Target& of = cell.targets[post.target];
    list.push_back(cylinder(of.id, post.frame, 2.0 * post.radius_m, post.length_m));
    add_carrier(cell.robot, of.carried_by, list.back());
  }
  return list;
}

json tool_to_json(const calib::Tool& tool) {
  return {{"frame", frame(tool.tcp)},
          {"radius_mm", number(tool.radius_m, kMmPerM)},
          {"tip_length_mm", number(tool.slim_length_m, kMmPerM)},
          {"tip_radius_mm", number(std::max(tool.slim_radius_m, tool.tip_radius_m), kMmPerM)}};
}

json way_to_json(const calib::PlannedTouch& touch, const calib::Robot& robot) {
  json way = json::array();
  for (const calib::JointVector& corner : touch.transit) way.push_back(shown_joints(corner, robot));
  return way;
}

/// 1 nm and 1e-7 deg: invisible rounding that halves the size.
constexpr double kDigits = 1e6;

double rounded(double value) { return std::round(value * kDigits) / kDigits; }

/// With 1 sigma.
json zeros_to_json(const calib::Calibration& found) {
  json list = json::array();
  for (const calib::ZeroOffset& one : zero_offsets(found))
    list.push_back({{"joint", one.joint},
                    {"deg", number(one.offset_rad, calib::kDegPerRad)},
                    {"sigma_deg", number(one.sigma_rad, calib::kDegPerRad)}});
  return list;
}

json session_to_json(const SessionRecord& record, const calib::Calibration& found) {
  const bool checked = found.check.count > 0;
  return {{"session", record.id},
          {"ended", record.ended},
          {"publish", found.verdict.publish()},
          {"fit_mm", number(found.after.mean_m, kMmPerM)},
          {"check_mm", checked ? number(found.check.mean_m, kMmPerM) : json(nullptr)},
          {"workspace_mm", number(found.predicted_workspace_m, kMmPerM)},
          {"zeros", zeros_to_json(found)}};
}

json standing_to_json(const calib::Standing& standing) {
  return {{"holds", calib::to_string(standing.holding)},
          {"by_check", standing.by_check},
          {"evidence_s", number(standing.evidence_s)},
          {"due_s", number(standing.due_s)}};
}

/// The chart as serialised by calib, with its calibration.
json checks_to_json(const Drift& checks, const calib::Language& language) {
  json chart = json::parse(calib::drift_to_json(checks.chart, language));
  chart["calibration"] = checks.calibrated;
  chart["calibrated"] = checks.calibrated_at;
  chart["cell"] = checks.cell;
  chart["standing"] = standing_to_json(checks.standing);
  return chart;
}

json acknowledged_to_json(const AdviceStatus& controller) {
  const bool acknowledged = controller.acknowledged.has_value();
  return {
      {"told", acknowledged ? json(to_string(*controller.acknowledged)) : json(nullptr)},
      {"value", acknowledged ? json(static_cast<int>(*controller.acknowledged)) : json(nullptr)},
      {"told_at", acknowledged ? json(controller.acknowledged_at) : json(nullptr)},
      {"trouble", controller.trouble.empty() ? json(nullptr) : json(controller.trouble)}};
}

}  // namespace

std::optional<double> residual_m(const calib::Calibration& calibration, const calib::Touch& touch) {
  return FoundArm(calibration).residual_m(touch);
}

std::string figures_to_json(const SessionRecord& record, const calib::Cell& cell,
                            const std::vector<calib::Touch>& touches,
                            const calib::Calibration* calibration,
                            const std::map<std::size_t, FigureOfTouch>& made,
                            const calib::Language& language) {
  const calib::ArmModel nominal(cell);
  std::optional<FoundArm> found;
  if (calibration != nullptr) found.emplace(*calibration);
  json list = json::array();
  for (std::size_t i = 0; i < touches.size(); ++i)
    list.push_back(touch_to_json(i, touches[i], nominal, found,
                                 made.contains(i) ? made.at(i) : FigureOfTouch()));
  return dump({{"session", record.id},
               {"state", to_string(record.state)},
               {"outcome", outcome_with_words(record.outcome, language)},
               {"touches", std::move(list)},
               {"result",
                calibration == nullptr ? json(nullptr) : result_to_json(*calibration, language)}});
}

std::string scene_to_json(std::int64_t session, const calib::Cell& cell) {
  const Eigen::Vector3d up = calib::up_of(cell.robot);
  const calib::Cell still =
      calib::at_setting(cell, std::vector<double>(cell.robot.positioner.size(), 0.0));
  json value{{"session", session},
             {"robot", cell.robot.name},
             {"base", frame(cell.robot.base_fixed)},
             {"joints", joints_to_json(cell.robot)},
             {"flange", frame(cell.robot.flange_fixed)},
             {"tool", tool_to_json(cell.tool)},
             {"targets", targets_to_json(cell, still)},
             {"stands", stands_to_json(cell, still)},
             {"obstacles", obstacles_to_json(cell, still)},
             {"up", {up.x(), up.y(), up.z()}},
             {"floor_mm", cell.floor_m ? number(*cell.floor_m, kMmPerM) : json(nullptr)}};
  if (!cell.robot.positioner.empty()) value["positioner"] = positioner_to_json(cell.robot);
  return dump(value);
}

std::string plan_to_json(std::int64_t session, std::size_t first, const calib::Plan& plan,
                         const calib::Cell& cell) {
  const calib::ArmModel arm(cell);
  json touches = json::array();
  for (std::size_t i = 0; i < plan.touches.size(); ++i) {
    const calib::PlannedTouch& touch = plan.touches[i];
    const Eigen::Vector3d tip = arm.nominal_tip_m(touch.standoff) - touch.expected_m * touch.normal;
    touches.push_back({{"index", first + i},
                       {"target", touch.target},
                       {"set", to_string(touch.set)},
                       {"way_deg", way_to_json(touch, cell.robot)},
                       {"joints_deg", shown_joints(touch.standoff, cell.robot)},
                       {"tip_mm", mm(tip)}});
    add_positioner(touch.positioner_rad, touches.back());
  }
  return dump({{"session", session}, {"touches", std::move(touches)}});
}

json number(double value, double factor) {
  if (!std::isfinite(value * factor)) return nullptr;
  return rounded(value * factor);
}

json mm(const Eigen::Vector3d& point_m) {
  json list = json::array();
  for (const double value : point_m) list.push_back(number(value, calib::kMmPerM));
  return list;
}

json frame(const Eigen::Isometry3d& frame) {
  json list = json::array();
  for (int row = 0; row < 3; ++row) {
    // Direction components are dimensionless and not converted.
    for (int column = 0; column < 3; ++column) list.push_back(frame.linear()(row, column));
    list.push_back(number(frame.translation()[row], calib::kMmPerM));
  }
  return list;
}

json shown_joints(const calib::JointVector& joint_rad, const calib::Robot& robot) {
  json list = json::array();
  for (std::size_t i = 0; i < joint_rad.size(); ++i)
    list.push_back(number(joint_rad[i], i < robot.joints.size()
                                            ? calib::unit_of(robot.joints[i]).per_si
                                            : calib::kDegPerRad));
  return list;
}

std::string drift_to_json(
    const std::vector<SessionRecord>& newest_first, std::string cell,
    const std::function<std::optional<calib::Calibration>(std::int64_t)>& calibration,
    const Drift* checks, const AdviceStatus& controller, const calib::Language& language) {
  json list = json::array();
  for (const SessionRecord& record : newest_first) {
    if (list.size() == kMostCompared) break;
    if (record.state != RecordState::kDone) continue;
    if (!cell.empty() && record.inputs.cell_name != cell) continue;
    const auto found = calibration(record.id);
    if (!found) continue;
    cell = record.inputs.cell_name;
    list.push_back(session_to_json(record, *found));
  }
  std::reverse(list.begin(), list.end());
  return dump(
      {{"cell", cell},
       {"sessions", std::move(list)},
       {"checks", checks != nullptr ? checks_to_json(*checks, language) : json(nullptr)},
       {"controller", controller.configured ? acknowledged_to_json(controller) : json(nullptr)}});
}

}  // namespace cellcal::daemon::web
