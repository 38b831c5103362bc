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

void refuse_positioner(const Robot& robot, const std::string& what, const std::string& instead) {
  if (!robot.positioner.empty())
    throw PositionerError(what + " is not possible yet for an arm with a positioner (" +
                          robot.positioner[0].name + "). " + instead);
}

void refuse_external_axes(const Robot& robot, const std::string& what, const std::string& instead) {
  refuse_linear_unit(robot, what, instead);
  refuse_positioner(robot, what, instead);
}

Eigen::Isometry3d carried_at(const Robot& robot, std::span<const double> positioner_rad) {
  Eigen::Isometry3d place = Eigen::Isometry3d::Identity();
  for (std::size_t j = 0; j < positioner_rad.size(); ++j) {
    const PositionerAxis& axis = robot.positioner.at(j);
    place = place * axis.frame *
            Eigen::AngleAxisd(axis.sign * positioner_rad[j], Eigen::Vector3d::UnitZ());
  }
  return place;
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
