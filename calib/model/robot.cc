#include "calib/model/robot.h"

#include <stdexcept>

#include "calib/model/error.h"
#include "calib/model/units.h"

namespace cellcal::calib {

JointUnit unit_of(const Joint& joint) {
  return joint.is_prismatic() ? JointUnit{kMmPerM, "mm"} : JointUnit{kDegPerRad, "deg"};
}

void refuse_linear_unit(const Robot& robot, const std::string& what, const std::string& instead) {
  if (robot.first_turning() > 0)
    throw LinearUnitError(what + " is not possible yet for an arm on a linear unit (" +
                          robot.joints[0].name + "). " + instead);
}

std::size_t Cell::target_index(const std::string& id) const {
  for (std::size_t i = 0; i < targets.size(); ++i)
    if (targets[i].id == id) return i;
  throw std::out_of_range("no target \"" + id + "\" in the cell");
}

namespace {

struct KindName {
  const char* name;
  TargetKind kind;
};
constexpr KindName kKinds[] = {{"sphere", TargetKind::kSphere},
                               {"wire", TargetKind::kWire},
                               {"plane", TargetKind::kPlane},
                               {"point", TargetKind::kPoint},
                               {"tracker", TargetKind::kTracker}};

}  // namespace

const char* to_string(TargetKind kind) {
  for (const KindName& one : kKinds)
    if (one.kind == kind) return one.name;
  return "";
}

std::optional<TargetKind> target_kind(std::string_view name) {
  for (const KindName& one : kKinds)
    if (one.name == name) return one.kind;
  return std::nullopt;
}

}  // namespace cellcal::calib
