#include "calib/model/robot.h"

#include <algorithm>
#include <stdexcept>

#include "calib/model/error.h"
#include "calib/model/units.h"

namespace cellcal::calib {

Eigen::Vector3d up_of(const Robot& robot) {
  const Eigen::Vector3d up = -robot.gravity_m_s2.normalized();
  return up.allFinite() && !up.isZero() ? up : Eigen::Vector3d::UnitZ();
}

Eigen::Vector3d shaft_of(const Tool& tool) {
  constexpr double kNoLengthM = 1e-6;
  return tool.tcp.translation().norm() > kNoLengthM ? tool.tcp.translation().normalized()
                                                    : Eigen::Vector3d::UnitZ();
}

Eigen::Vector3d stand_up(const Robot& robot, const Target& target) {
  return target.stand_up.isZero() ? up_of(robot) : target.stand_up;
}

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

std::array<Eigen::Vector3d, kMaxPositionerAxes> carried_moment_nm(
    const Robot& robot, std::span<const double> positioner_rad) {
  if (positioner_rad.size() > std::min<std::size_t>(robot.positioner.size(), kMaxPositionerAxes))
    throw std::out_of_range("carried_moment_nm: more angles than the positioner has axes");
  std::array<Eigen::Vector3d, kMaxPositionerAxes> moment;
  moment.fill(Eigen::Vector3d::Zero());
  std::array<double, kMaxPositionerAxes> all{};
  std::ranges::copy(positioner_rad, all.begin());
  const std::span<const double> angles(all);
  double mass_kg = 0.0;
  Eigen::Vector3d mass_times_com = Eigen::Vector3d::Zero();  // in the frame that axis j carries
  for (std::size_t j = robot.positioner.size(); j-- > 0;) {
    const PositionerAxis& axis = robot.positioner[j];
    mass_kg += axis.mass_kg;
    mass_times_com += axis.mass_kg * axis.com_m;
    mass_times_com =
        Eigen::AngleAxisd(axis.sign * angles[j], Eigen::Vector3d::UnitZ()) * mass_times_com;
    const Eigen::Matrix3d stands = (carried_at(robot, angles.first(j)) * axis.frame).linear();
    moment[j] = mass_times_com.cross(stands.transpose() * robot.gravity_m_s2);
    mass_times_com = axis.frame.linear() * mass_times_com + mass_kg * axis.frame.translation();
  }
  return moment;
}

std::size_t Cell::target_index(const std::string& id) const {
  for (std::size_t i = 0; i < targets.size(); ++i)
    if (targets[i].id == id) return i;
  throw std::out_of_range("no target \"" + id + "\" in the cell");
}

}  // namespace cellcal::calib
