#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <ranges>

#include "calib/estimate/external_axes.h"
#include "calib/model/error.h"
#include "calib/model/kinematics.h"
#include "calib/model/linear.h"
#include "calib/model/units.h"
#include "daemon/krl/fix_lines.h"

namespace cellcal::daemon::krl {

namespace {

using calib::ArmModel;
using calib::kDegPerRad;
using calib::kMmPerM;
using Eigen::Isometry3d;
using Eigen::Vector3d;

constexpr std::size_t kMotions = calib::kGuideMotions;
constexpr double kNmPerKnm = 1000.0;
/// Beyond every angle of an axis.
constexpr double kAnyDeg = 1e6;

/// (1b): the slope of each motion, and its waves.
struct Guide {
  std::array<double, kMotions> slope{};            ///< mm or degrees per mm
  std::vector<std::array<double, kMotions>> wave;  ///< mm or degrees, by order
};

Guide guide_of(const ArmModel& arm, const Eigen::VectorXd& x) {
  const calib::Joint& unit = arm.robot().joints.front();
  Guide guide;
  guide.wave.resize(static_cast<std::size_t>(calib::guide_orders(unit.max_rad - unit.min_rad)));
  for (int p = 0; p < arm.size(); ++p) {
    const calib::ArmParameter& parameter = arm.parameters()[static_cast<std::size_t>(p)];
    if (parameter.kind != calib::ParameterKind::kGuide) continue;
    const auto motion = static_cast<std::size_t>(parameter.axis);
    const auto order = static_cast<std::size_t>(parameter.harmonic);
    const double unit_of_file = is_shift(calib::GuideMotion{parameter.axis}) ? kMmPerM : kDegPerRad;
    if (order == 0)
      guide.slope[motion] += x[p] * unit_of_file / kMmPerM;
    else
      guide.wave.at(order - 1)[motion] += x[p] * unit_of_file;
  }
  return guide;
}

void write_unit(const calib::Calibration& c, Lines& out) {
  Guide guide;
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();
  Vector3d along = Vector3d::Zero();
  double half_wave = 0.0;
  if (c.cell.robot.first_turning() > 0) {
    const ArmModel arm(at_level(c.cell, c.level));
    guide = guide_of(arm, arm_values(arm, c));
    axes = calib::guide_axes(c.cell.robot);
    along = c.cell.robot.base_fixed.linear() * axes.col(0);
    const calib::Joint& unit = c.cell.robot.joints.front();
    half_wave = 180.0 / ((unit.max_rad - unit.min_rad) * kMmPerM);
  }
  out.comment("linear unit: its travel, the guide's axes, slopes per mm and waves by their order");
  out.value("FRAME", "CCF_XALONG", frame(Vector3d(along * kMmPerM)));
  out.value("FRAME", "CCF_XGUIDE", frame(Isometry3d(axes)));
  out.reals("CCF_XSLOPE", guide.slope, [](double one) { return one; });
  out.value("REAL", "CCF_XHALFWAVE", real(half_wave));
  out.value("INT", "CCF_XORDERS", std::to_string(guide.wave.size()));
  out.blank("REAL",
            fmt::format("CCF_XWAVE[{},{}]", kMotions, std::max<std::size_t>(1, guide.wave.size())));
  for (std::size_t k = 0; k < kMotions; ++k)
    for (std::size_t h = 0; h < guide.wave.size(); ++h)
      out.line(fmt::format("CCF_XWAVE[{},{}]={}", k + 1, h + 1, real(guide.wave[h][k])));
}

/// Range of an axis, and how far FORWARD turns it.
struct Range {
  double least = 0.0, most = 0.0, middle = 0.0, step = 0.0;
};

std::vector<Range> ranges_of(const calib::Calibration& c, bool anywhere) {
  constexpr double kStepDeg = 30.0;
  std::vector<Range> all;
  if (c.cell.robot.first_turning() > 0) {
    const calib::Joint& unit = c.cell.robot.joints.front();
    all.push_back({unit.min_rad * kMmPerM, unit.max_rad * kMmPerM,
                   (unit.min_rad + unit.max_rad) / 2.0 * kMmPerM, 0.0});
  }
  for (std::size_t j = 0; j < c.cell.robot.positioner.size(); ++j) {
    const calib::PositionerAxis& axis = c.cell.robot.positioner[j];
    Range one{-kAnyDeg, kAnyDeg, (axis.min_rad + axis.max_rad) / 2.0 * kDegPerRad,
              std::min(kStepDeg, (axis.max_rad - axis.min_rad) / 2.0 * kDegPerRad)};
    if (j < c.positioner.size() && c.positioner[j].touched_rad && !anywhere) {
      one.least = (*c.positioner[j].touched_rad)[0] * kDegPerRad;
      one.most = (*c.positioner[j].touched_rad)[1] * kDegPerRad;
    }
    all.push_back(one);
  }
  return all;
}

/// All kinematics as drawn, or all as found.
bool as_found(const Carriers& carriers) {
  bool found = false, drawn = false;
  for (const auto& [index, one] : carriers.mounted()) (one.as_found ? found : drawn) = true;
  if (found && drawn)
    throw calib::FileError(
        "the machine data have one kinematic of the positioner as drawn and another one as found. "
        "Enter the same axes for all of MACHINE_DEF");
  return found;
}

void write_positioner(const calib::Calibration& c, const Carriers& carriers, Lines& out) {
  const std::vector<calib::PositionerAxis>& axes = c.cell.robot.positioner;
  const bool found = as_found(carriers);
  const auto indices = std::views::iota(std::size_t{0}, axes.size());
  const bool loaded = std::ranges::any_of(axes, [](const auto& one) { return one.mass_kg > 0.0; });
  const auto& mounted = carriers.mounted();
  std::size_t most = 0;
  for (const auto& [index, one] : mounted) most = std::max(most, one.kinematic->axes.size());
  const std::string none = frame(calib::FrameMmDeg{});
  out.comment(
      "positioner: axes that may carry a base, as the controller has them and as calibrated");
  out.value("INT", "CCF_XAXES", std::to_string(most));
  const auto as_calibrated = [&](std::size_t j) { return frame(calib::axis_as_found(c, j)); };
  out.each(
      "FRAME", "CCF_XDRAWN", indices,
      [&](std::size_t j) { return found ? as_calibrated(j) : frame(axes[j].frame); }, none);
  out.each("FRAME", "CCF_XFOUND", indices, as_calibrated, none);
  out.reals("CCF_XSIGN", axes, [](const auto& one) { return one.sign; });
  out.reals("CCF_XREAL", indices, [&](std::size_t j) {
    const auto scale = calib::positioner_parameter(j, calib::AxisError::kScale);
    return axes[j].sign * (1.0 + correction_of(c, scale));
  });
  out.comment(
      "masses that the axes turn, with their centres, and how far an axis gives about x, y and z");
  out.value("INT", "CCF_XLOADS", std::to_string(loaded ? axes.size() : 0));
  out.value("FRAME", "CCF_XDOWN", frame(c.cell.robot.gravity_m_s2));
  out.reals("CCF_XKG", axes, [](const auto& one) { return one.mass_kg; });
  out.each(
      "FRAME", "CCF_XCOM", axes,
      [](const auto& one) { return frame(Vector3d(one.com_m * kMmPerM)); }, none);
  out.each(
      "FRAME", "CCF_XSOFT", indices,
      [&](std::size_t j) {
        return frame(Vector3d(calib::give_rad_per_nm(c, j) * kDegPerRad * kNmPerKnm));
      },
      none);
  out.comment("MACHINE_DEF: number, axes, its flange in the frame that these carry");
  out.value("INT", "CCF_XMACHINES", std::to_string(mounted.size()));
  out.each(
      "INT", "CCF_XMACH", mounted, [](const auto& one) { return std::to_string(one.first); }, "0");
  out.each(
      "INT", "CCF_XCARRIED", mounted,
      [](const auto& one) { return std::to_string(one.second.kinematic->axes.size()); }, "0");
  out.each(
      "FRAME", "CCF_XMOUNT", mounted, [](const auto& one) { return frame(one.second.mount); },
      none);
}

}  // namespace

std::vector<std::string> external_names(const calib::Robot& robot) {
  std::vector<std::string> names;
  if (unit_axis(robot) > 0) names.push_back(name_of_axis(unit_axis(robot)));
  for (const calib::PositionerAxis& axis : robot.positioner) {
    if (calib::external_axis(axis.name) == 0)
      throw calib::FileError(
          "a correction at run time needs E1 to E6 as names of the positioner's "
          "axes, and " +
          axis.name + " is none. Rename it in the robot file");
    names.push_back(axis.name);
  }
  return names;
}

void write_external(const calib::Calibration& c, const Carriers& carriers, bool anywhere,
                    Lines& out) {
  if (!carriers.unit_fits())
    throw calib::FileError(
        "the machine data have another linear unit than the calibration, or none. Compare "
        "$EX_KIN, $ET1_TA1KR and $AXIS_DIR[7] with the robot file");
  const std::vector<Range> ranges = ranges_of(c, anywhere);
  out.comment("external axes: mm and degrees");
  out.value("INT", "CCF_XUNITS", std::to_string(c.cell.robot.first_turning()));
  out.value("FRAME", "CCF_XRAIL", frame(carriers.rail_in_world()));
  out.reals("CCF_XLEAST", ranges, [](const Range& one) { return one.least; });
  out.reals("CCF_XMOST", ranges, [](const Range& one) { return one.most; });
  out.reals("CCF_XMID", ranges, [](const Range& one) { return one.middle; });
  out.reals("CCF_XSTEP", ranges, [](const Range& one) { return one.step; });
  write_unit(c, out);
  write_positioner(c, carriers, out);
}

}  // namespace cellcal::daemon::krl
