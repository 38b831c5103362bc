#include "daemon/web/plan.h"

#include "calib/model/kinematics.h"
#include "daemon/web/json.h"

namespace cellcal::daemon::web {

using nlohmann::json;

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
                       {"joints_deg", degrees(touch.standoff)},
                       {"tip_mm", mm(tip)}});
  }
  return dump({{"session", session}, {"touches", std::move(touches)}});
}

}  // namespace cellcal::daemon::web
