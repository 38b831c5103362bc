#include "daemon/api/page_drift.h"

#include <algorithm>

#include "calib/files/check_json.h"
#include "calib/model/units.h"
#include "daemon/api/page_scene.h"

namespace cellcal::daemon::web {

using nlohmann::json;

namespace {

using calib::kMmPerM;

/// Zero offset of each joint relative to nominal, with 1 sigma.
json zeros_to_json(const calib::Calibration& found) {
  json list = json::array();
  for (const calib::ParameterResult& one : found.parameters) {
    if (one.key.kind != calib::ParameterKind::kTheta || one.key.joint < 0) continue;
    list.push_back(
        {{"joint", found.cell.robot.joints.at(static_cast<std::size_t>(one.key.joint)).name},
         {"deg", number(one.correction, calib::kDegPerRad)},
         {"sigma_deg", number(one.sigma, calib::kDegPerRad)}});
  }
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

/// The chart as serialised by calib, with its calibration.
json checks_to_json(const Drift& checks) {
  json chart = json::parse(calib::drift_to_json(checks.chart));
  chart["calibration"] = checks.calibrated;
  chart["calibrated"] = checks.calibrated_at;
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

std::string drift_to_json(
    const std::vector<SessionRecord>& newest_first, std::string cell,
    const std::function<std::optional<calib::Calibration>(std::int64_t)>& calibration,
    const Drift* checks, const AdviceStatus& controller) {
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
       {"checks", checks != nullptr ? checks_to_json(*checks) : json(nullptr)},
       {"controller", controller.configured ? acknowledged_to_json(controller) : json(nullptr)}});
}

}  // namespace cellcal::daemon::web
