#include "daemon/cell_form/cell_form.h"

#include <fmt/format.h>

#include "calib/files/cell_file.h"
#include "calib/files/files.h"
#include "calib/files/input_file.h"
#include "calib/model/kinematics.h"
#include "calib/model/units.h"
#include "calib/plan/cell_check.h"
#include "daemon/cell_form/cell_text.h"

namespace cellcal::daemon {

namespace {

/// Stands in while there is no sphere yet: a cell has one at least. It contradicts nothing.
const SphereForm kAnySphere{.id = "sphere", .diameter_mm = 50.0};

}  // namespace

NamedRobotFile find_robot(const std::string& given, const std::filesystem::path& cell_file) {
  NamedRobotFile found;
  // A name is looked for where robots are shipped, a path from where the user is.
  const bool is_path = given.find('/') != std::string::npos || given.ends_with(".toml");
  std::filesystem::path file;
  if (is_path && std::filesystem::is_regular_file(given)) {
    file = std::filesystem::absolute(given).lexically_normal();
    const auto folder = std::filesystem::absolute(cell_file).lexically_normal().parent_path();
    const auto beside = file.lexically_relative(folder);
    found.reference = !beside.empty() && *beside.begin() != ".." ? beside.string() : file.string();
  } else {
    file = calib::find_robot_file(given, {});
    found.reference = given;
  }
  found.name = file.string();
  found.text = calib::read_file(file, calib::kMostTomlBytes);
  calib::read_robot(calib::TomlTable::parse(found.text, found.name));
  return found;
}

calib::Cell cell_of(const CellForm& form) {
  return calib::parse_cell({"new cell", cell_text(form), form.robot.name, form.robot.text});
}

std::string objection(const CellForm& form) {
  CellForm whole = form;
  if (whole.spheres.empty()) whole.spheres.push_back(kAnySphere);
  try {
    for (const calib::CellFault& fault : calib::faults_of(cell_of(whole)))
      if (fault.refused) return found_words(fault) + ". " + advice_words(fault);
  } catch (const calib::FileError& error) {
    return error.what();
  }
  return {};
}

Triple tip_mm(const CellForm& form, const std::vector<double>& joint_deg) {
  CellForm arm = form;
  arm.spheres = {kAnySphere};
  arm.lengths.clear();
  const calib::Cell cell = cell_of(arm);
  const auto& joints = cell.robot.joints;
  if (joint_deg.size() != joints.size())
    throw calib::FileError(fmt::format("there must be {} angles, A1 first", joints.size()));
  std::vector<double> joint_rad;
  for (std::size_t i = 0; i < joints.size(); ++i) {
    joint_rad.push_back(joint_deg[i] * calib::kRadPerDeg);
    const bool limited = joints[i].min_rad < joints[i].max_rad;
    if (limited && (joint_rad[i] < joints[i].min_rad || joint_rad[i] > joints[i].max_rad))
      throw calib::FileError(fmt::format(
          "{} at {} deg is beyond its limits, {:.1f} to {:.1f} deg. Type the angles as the pendant shows them",
          joints[i].name, joint_deg[i], joints[i].min_rad * calib::kDegPerRad,
          joints[i].max_rad * calib::kDegPerRad));
  }
  const Eigen::Vector3d tip =
      calib::ArmModel(cell.robot, cell.tool).nominal_tcp(joint_rad).translation() * calib::kMmPerM;
  return {tip.x(), tip.y(), tip.z()};
}

Triple centre_below(const CellForm& form, const std::vector<double>& joint_deg,
                    double diameter_mm) {
  const Triple tip = tip_mm(form, joint_deg);
  const calib::Robot robot =
      calib::read_robot(calib::TomlTable::parse(form.robot.text, form.robot.name));
  const Eigen::Vector3d down = robot.gravity_m_s2.norm() > 0.0
                                   ? Eigen::Vector3d(robot.gravity_m_s2.normalized())
                                   : Eigen::Vector3d(-Eigen::Vector3d::UnitZ());
  const double depth_mm = diameter_mm / 2.0 + form.tool.tip_radius_mm;
  return {tip[0] + depth_mm * down.x(), tip[1] + depth_mm * down.y(), tip[2] + depth_mm * down.z()};
}

}  // namespace cellcal::daemon
