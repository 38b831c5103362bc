#include "daemon/krl/carriers.h"

#include <algorithm>

#include "calib/estimate/external_axes.h"
#include "calib/model/units.h"
#include "daemon/krl/point_value.h"

namespace cellcal::daemon::krl {

namespace {

using calib::JointVector;
using Eigen::Isometry3d;
using Eigen::Vector3d;

/// Machine data and robot file describe the same axis: the travel over some metres, and a table of 0.5 m.
constexpr double kSameTravelRad = 2e-6, kSamePlaceM = 5e-5, kTableM = 0.5;

bool same_place(const Isometry3d& a, const Isometry3d& b) {
  return (a.translation() - b.translation()).norm() < kSamePlaceM &&
         Eigen::AngleAxisd(a.linear().transpose() * b.linear()).angle() * kTableM < kSamePlaceM;
}

/// One axis or two, each at 0 and at a radian.
std::vector<std::vector<double>> settings(std::size_t axes) {
  std::vector<std::vector<double>> all;
  for (unsigned bits = 1; bits < 1U << axes; ++bits) {
    std::vector<double> one;
    for (std::size_t j = 0; j < axes; ++j) one.push_back((bits >> j & 1U) != 0U ? 1.0 : 0.0);
    all.push_back(std::move(one));
  }
  return all;
}

calib::Robot with_axes_as_found(const calib::Calibration& c) {
  calib::Robot robot = c.cell.robot;
  for (std::size_t j = 0; j < robot.positioner.size(); ++j)
    robot.positioner[j].frame = calib::axis_as_found(c, j);
  return robot;
}

}  // namespace

std::string name_of_axis(int axis) { return "E" + std::to_string(axis); }

int unit_axis(const calib::Robot& robot) {
  return robot.first_turning() > 0 ? std::max(1, calib::external_axis(robot.joints.front().name))
                                   : 0;
}

Carriers::Carriers(const calib::Calibration& calibration, const Data& data)
    : calibration_(calibration), data_(data) {
  const calib::Robot& robot = calibration.cell.robot;
  unit_ = unit_axis(robot);
  if (unit_ > 0) {
    understood_.insert(unit_);
    unit_fits_ = fits_the_unit();
  }
  for (const calib::PositionerAxis& axis : robot.positioner)
    if (const int number = calib::external_axis(axis.name); number > 0) understood_.insert(number);
  for (const calib::TargetResult& target : calibration.targets)
    for (const calib::Target& stated : calibration.cell.targets)
      if (stated.id == target.id)
        touched_axes_ = std::max(touched_axes_, static_cast<std::size_t>(stated.carried_by));
  for (const auto& [index, machine] : data.external.machines)
    if (const auto found = mounting(machine)) mounted_.emplace(index, *found);
}

/// Machine data, where they are given, have this unit and nothing else below the arm.
bool Carriers::fits_the_unit() const {
  const calib::ExternalAxes& external = data_.external;
  if (!external.carry_arm) return true;
  const calib::MachineKinematic* const kinematic = external.of_kind("#ERSYS");
  if (kinematic == nullptr || kinematic->axes != std::vector<int>{unit_}) return false;
  const auto flange = calib::flange_of(*kinematic, std::vector<double>{0.0});
  if (!flange) return false;
  const Eigen::Matrix3d travels = calib::to_isometry(kinematic->frames.at("TA1KR")).linear();
  Eigen::Matrix3d foot = flange->linear();
  if (data_.robroot) foot *= calib::to_isometry(*data_.robroot).linear();
  const Vector3d along = external.drives[0].sense * (foot.transpose() * travels.col(2));
  const calib::Robot& robot = calibration_.cell.robot;
  const Vector3d drawn = robot.base_fixed.linear() * robot.joints.front().guide->along;
  return along.cross(drawn).norm() < kSameTravelRad && along.dot(drawn) > 0.0;
}

Isometry3d Carriers::foot_in_world() const {
  return rail_in_world() * calib::to_isometry(data_.robroot.value_or(calib::FrameMmDeg{}));
}

Isometry3d Carriers::rail_in_world() const {
  const calib::ExternalAxes none;
  return calib::foot_in_world(unit_ > 0 ? data_.external : none, std::nullopt);
}

std::optional<Carriers::Mounted> Carriers::mounting(const calib::MachineDef& machine) const {
  const calib::Robot& robot = calibration_.cell.robot;
  Mounted one;
  one.kinematic = data_.external.of_kind(machine.kind);
  if (one.kinematic == nullptr || machine.kind == "#ERSYS") return std::nullopt;
  const std::size_t axes = one.kinematic->axes.size();
  if (axes == 0 || axes > std::min(touched_axes_, robot.positioner.size())) return std::nullopt;
  for (std::size_t j = 0; j < axes; ++j)
    if (calib::external_axis(robot.positioner[j].name) != one.kinematic->axes[j])
      return std::nullopt;
  one.root = foot_in_world().inverse() * calib::to_isometry(machine.root);
  const std::vector<double> zero(axes);
  const auto flange = calib::flange_of(*one.kinematic, zero);
  if (!flange) return std::nullopt;
  // The data are those of the drawing, or the axes as found that were put into them.
  for (const bool as_found : {false, true}) {
    const calib::Robot known = as_found ? with_axes_as_found(calibration_) : robot;
    one.as_found = as_found;
    one.mount = calib::carried_at(known, zero).inverse() * one.root * *flange;
    bool same = true;
    for (const std::vector<double>& angles : settings(axes))
      same = same && same_place(calib::carried_at(known, angles) * one.mount,
                                one.root * *calib::flange_of(*one.kinematic, angles));
    if (same) return one;
  }
  return std::nullopt;
}

std::optional<Why> Carriers::wrong_value(const Point& point) const {
  if (const auto wrong = krl::wrong_value(point, data_.external, understood_)) return wrong;
  if (unit_ == 0) return std::nullopt;
  if (!unit_fits_) return Why::kOtherUnit;
  const bool stated = point.value.numbers.count(name_of_axis(unit_)) > 0;
  return stated ? std::nullopt : std::optional(Why::kNoExternalValue);
}

double Carriers::unit_m(const Point& point) const {
  if (unit_ == 0) return 0.0;
  return point.value.numbers.at(name_of_axis(unit_)).value / calib::kMmPerM;
}

JointVector Carriers::axes_of(const Point& point) const {
  JointVector q;
  if (unit_ > 0) q.push_back(unit_m(point));
  for (int i = 1; i <= 6; ++i)
    q.push_back(point.value.numbers.at("A" + std::to_string(i)).value * calib::kRadPerDeg);
  return q;
}

JointVector Carriers::at_the_unit(JointVector joints, const Point& point) const {
  if (unit_ > 0) joints.front() = unit_m(point);
  return joints;
}

int Carriers::machine_of(const FrameRef& base) const {
  if (base.machine > 0) return base.machine;
  if (base.literal) return 0;
  const auto carried = data_.external.carried_bases.find(base.number);
  if (carried == data_.external.carried_bases.end()) return 0;
  return base.machine < 0 ? -1 : carried->second;
}

std::variant<CarriedFlange, Why> Carriers::flange(int machine, const Point& point) const {
  const auto at = mounted_.find(machine);
  if (machine < 0 && touched_axes_ > 0) return Why::kUncoupledBase;
  if (at == mounted_.end())
    return touched_axes_ == 0 || data_.external.machines.count(machine) == 0 ? Why::kExternalBase
                                                                             : Why::kOtherKinematic;
  const Mounted& one = at->second;
  CarriedFlange found;
  for (const int axis : one.kinematic->axes) {
    const auto value = point.value.numbers.find(name_of_axis(axis));
    if (value == point.value.numbers.end()) return Why::kNoExternalValue;
    found.carrier_rad.push_back(value->second.value * calib::kRadPerDeg);
  }
  found.mount = one.mount;
  found.nominal = one.root * *calib::flange_of(*one.kinematic, found.carrier_rad);
  std::vector<double> outer_rad;
  const auto& axes = calibration_.cell.robot.positioner;
  for (std::size_t j = found.carrier_rad.size(); j < axes.size(); ++j) {
    const auto value = point.value.numbers.find(axes[j].name);
    const bool stated = value != point.value.numbers.end();
    // It loads those before it, where the motion before left it.
    if (!stated && axes[j].mass_kg > 0.0) return Why::kNoExternalValue;
    outer_rad.push_back(stated ? value->second.value * calib::kRadPerDeg : 0.0);
  }
  found.real = calib::carried_as_found(calibration_, found.carrier_rad, outer_rad) * one.mount;
  return found;
}

bool Carriers::touched(const CarriedFlange& flange) const {
  const auto& lines = calibration_.positioner;
  for (std::size_t j = 0; j < flange.carrier_rad.size() && j < lines.size(); ++j) {
    const auto& range = lines[j].touched_rad;
    const double at = flange.carrier_rad[j];
    if (range && !(at >= (*range)[0] - kSameTravelRad && at <= (*range)[1] + kSameTravelRad))
      return false;
  }
  return true;
}

}  // namespace cellcal::daemon::krl
