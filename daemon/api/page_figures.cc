#include "daemon/api/page_figures.h"

#include <algorithm>

#include "calib/model/kinematics.h"
#include "calib/model/units.h"
#include "calib/result/finding.h"
#include "daemon/api/page_scene.h"
#include "daemon/result/outcome_json.h"

namespace cellcal::daemon::web {

using nlohmann::json;

namespace {

using calib::kMmPerM;
using Eigen::Vector3d;

double value_of(const calib::Calibration& found, const calib::ParameterKey& key, double unknown) {
  const calib::ParameterResult* one = calib::find(found, key);
  return one == nullptr ? unknown : one->nominal + one->correction;
}

/// The calibrated arm.
class FoundArm {
 public:
  explicit FoundArm(const calib::Calibration& found)
      : found_(found), arm_(calib::at_level(found.cell, found.level)) {
    for (const calib::ArmParameter& parameter : arm_.parameters())
      errors_.push_back(value_of(found, parameter, 0.0));
    delay_s_ = value_of(found, calib::latch_delay_parameter(), found.cell.latch_delay_s);
  }

  std::optional<double> residual_m(const calib::Touch& touch) const {
    const auto target = std::find_if(found_.targets.begin(), found_.targets.end(),
                                     [&](const auto& one) { return one.id == touch.target; });
    // The effective radius belongs to the first tool.
    if (target == found_.targets.end() || !touch.tool.empty()) return std::nullopt;
    const Vector3d tip = arm_.position(arm_.prepare(touch.joint_rad), errors_.data());
    Vector3d outwards = target->normal;
    double distance = outwards.dot(tip - target->centre_m);
    if (target->kind == calib::TargetKind::kSphere) {
      outwards = (tip - target->centre_m).normalized();
      distance = (tip - target->centre_m).norm();
    } else if (target->kind != calib::TargetKind::kPlane) {
      return std::nullopt;
    }
    double closing = touch.speed_m_s;
    if (touch.approach) closing *= -Vector3d(touch.approach->data()).dot(outwards);
    return distance - target->effective_radius_m + closing * delay_s_;
  }

 private:
  const calib::Calibration& found_;
  calib::ArmModel arm_;
  std::vector<double> errors_;
  double delay_s_ = 0.0;
};

json touch_to_json(std::size_t index, const calib::Touch& touch, const calib::ArmModel& nominal,
                   const std::optional<FoundArm>& found, const FigureOfTouch& made) {
  const auto residual = found ? found->residual_m(touch) : made.residual_m;
  return {{"index", index},
          {"target", touch.target},
          {"set", to_string(touch.set)},
          {"joints_deg", degrees(touch.joint_rad)},
          {"tip_mm", mm(nominal.nominal_tip_m(touch.joint_rad))},
          {"residual_mm", residual ? number(*residual, kMmPerM) : json(nullptr)},
          {"u95_mm", made.u95_m ? number(*made.u95_m, kMmPerM) : json(nullptr)}};
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

json findings_to_json(const std::vector<calib::Finding>& findings) {
  json list = json::array();
  for (const calib::Finding& finding : findings)
    list.push_back(
        {{"kind", calib::to_string(finding.kind)},
         {"severity", calib::to_string(finding.severity)},
         {"cause", finding.cause ? json(calib::to_string(*finding.cause)) : json(nullptr)},
         {"about", about_to_json(finding.about)},
         {"evidence", evidence_to_json(finding.evidence)},
         {"parts", parts_to_json(finding.parts)},
         {"words", calib::words(finding)}});
  return list;
}

json result_to_json(const calib::Calibration& found) {
  // Files of an earlier version contain the value predicted from the tolerances there, and no U.
  const bool stated = found.nominal_workspace_u_m > 0.0;
  return {{"publish", found.verdict.publish()},
          {"scope", found.verdict.workspace ? "workspace" : "near targets"},
          {"findings", findings_to_json(found.verdict.findings)},
          {"before", summary(found.before)},
          {"after", summary(found.after)},
          {"check", summary(found.check)},
          {"near_targets_mm", number(found.predicted_near_targets_m, kMmPerM)},
          {"workspace_mm", number(found.predicted_workspace_m, kMmPerM)},
          {"nominal_workspace_mm", number(stated ? found.nominal_workspace_m : 0.0, kMmPerM)},
          {"nominal_workspace_u_mm", number(found.nominal_workspace_u_m, kMmPerM)}};
}

}  // namespace

std::optional<double> residual_m(const calib::Calibration& calibration, const calib::Touch& touch) {
  return FoundArm(calibration).residual_m(touch);
}

std::string figures_to_json(const SessionRecord& record, const calib::Cell& cell,
                            const std::vector<calib::Touch>& touches,
                            const calib::Calibration* calibration,
                            const std::map<std::size_t, FigureOfTouch>& made) {
  const calib::ArmModel nominal(cell);
  std::optional<FoundArm> found;
  if (calibration != nullptr) found.emplace(*calibration);
  json list = json::array();
  for (std::size_t i = 0; i < touches.size(); ++i)
    list.push_back(touch_to_json(i, touches[i], nominal, found,
                                 made.contains(i) ? made.at(i) : FigureOfTouch()));
  return dump({{"session", record.id},
               {"state", to_string(record.state)},
               {"outcome", outcome_with_words(record.outcome)},
               {"touches", std::move(list)},
               {"result", calibration == nullptr ? json(nullptr) : result_to_json(*calibration)}});
}

}  // namespace cellcal::daemon::web
