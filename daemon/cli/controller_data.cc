#include "daemon/cli/controller_data.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "calib/model/error.h"
#include "calib/model/units.h"
#include "daemon/cell_form/cell_text.h"
#include "daemon/files/atomic_file.h"

namespace cellcal::daemon {

namespace {

using calib::FrameMmDeg;
using calib::MachineData;

bool is_zero(const Triple& of) {
  return std::ranges::all_of(of, [](double value) { return value == 0.0; });
}
bool is_empty(const FrameMmDeg& frame) { return is_zero(frame.xyz_mm) && is_zero(frame.abc_deg); }

/// TOOL_DATA[3] "probe".
std::string named(const std::string& slot, int number, const std::map<int, std::string>& names) {
  const auto name = names.find(number);
  return slot + (name == names.end() ? "" : fmt::format(" \"{}\"", name->second));
}
std::string tool_name(const MachineData& data, int number) {
  return named(fmt::format("TOOL_DATA[{}]", number), number, data.tool_names);
}

std::string measured_words(const MachineData& data) {
  const std::string list = tool_list(data);
  return list.empty() ? "No tool is measured in them" : "Measured are " + list;
}

/// Bases are stated in the world.
FrameMmDeg in_the_arms_base(const MachineData& data, const FrameMmDeg& base) {
  return data.robroot ? calib::to_frame(calib::to_isometry(*data.robroot).inverse() *
                                        calib::to_isometry(base))
                      : base;
}

/// To 0.1 um and 0.1 arc seconds: calculated values have no more digits.
FrameMmDeg rounded(FrameMmDeg frame) {
  constexpr double kStep = 1e-4;
  for (Triple* one : {&frame.xyz_mm, &frame.abc_deg})
    for (double& value : *one) value = std::round(value / kStep) * kStep + 0.0;
  return frame;
}

std::optional<calib::Joint> linear_unit_or_warning(const MachineData& data) {
  try {
    return calib::linear_unit_of(data.external, data.robroot);
  } catch (const calib::FileError& error) {
    fmt::print(
        stderr,
        "warning: {}. What carries the arm is left out: the robot file is the arm's where it "
        "stands\n",
        error.what());
    return std::nullopt;
  }
}

std::vector<calib::PositionerAxis> positioner_or_warning(const MachineData& data) {
  try {
    return calib::positioner_of(data.external, data.robroot);
  } catch (const calib::FileError& error) {
    fmt::print(stderr,
               "warning: {}. The positioner is left out; if spheres are to be touched on it, add "
               "[[positioner]] tables to the robot file\n",
               error.what());
    return {};
  }
}

constexpr double kSameDirection = 2e-3;  // 0.1 deg

/// "[0, 0, 1]", to a thousandth.
std::string direction_words(const Eigen::Vector3d& direction) {
  const Eigen::Vector3d to = (direction * 1e3).array().round() / 1e3 + 0.0;
  return fmt::format("[{:g}, {:g}, {:g}]", to.x(), to.y(), to.z());
}

}  // namespace

bool has_an_arm(const MachineData& data) {
  return data.length_a_m || data.length_b_m || data.wrist || data.flange || data.base;
}

calib::Robot with_external_axes(calib::Robot arm, const calib::MachineData& data) {
  if (const auto unit = linear_unit_or_warning(data)) {
    const Eigen::Vector3d along = unit->guide->along;
    const bool there = arm.first_turning() > 0;
    fmt::print(stderr,
               "linear unit E1: {:g} to {:g} mm along [{:g}, {:g}, {:g}] of the arm's foot{}\n",
               unit->min_rad * calib::kMmPerM, unit->max_rad * calib::kMmPerM, along.x(), along.y(),
               along.z(),
               there ? " in the machine data. That of the robot file stays: compare them"
                     : ". Machine data state no speed of it: add max_speed_mm_s. Jog E1 and check "
                       "the direction");
    if (!there) arm.joints.insert(arm.joints.begin(), *unit);
  }
  if (!arm.positioner.empty()) return arm;
  arm.positioner = positioner_or_warning(data);
  for (const calib::PositionerAxis& axis : arm.positioner)
    fmt::print(stderr, "positioner {}: {:g} to {:g} deg. Jog it and check its place and sense\n",
               axis.name, axis.min_rad * calib::kDegPerRad, axis.max_rad * calib::kDegPerRad);
  if (!arm.positioner.empty())
    fmt::print(
        stderr,
        "Machine data state no load of a positioner: add mass_kg and com_mm of table, fixture "
        "and workpiece to [[positioner]]. Without them its axes count as stiff\n");
  return arm;
}

void compare_mounting(const MachineData& data, const calib::Robot& robot, const std::string& file,
                      bool taken) {
  const Eigen::Vector3d here = -calib::up_of(robot);
  const auto gravity = calib::gravity_of(data);
  if (!gravity || gravity->normalized().isApprox(here, kSameDirection)) return;
  fmt::print(
      stderr,
      "warning: gravity along {} of the arm's foot in the controller ($ROBROOT), along {} in {}. {}\n",
      direction_words(gravity->normalized()), direction_words(here), file,
      taken ? "The controller's is taken"
            : fmt::format("It stays: 'cellcal import-robot --robot {} --machine-data ... -o FILE' "
                          "makes a robot file with the controller's",
                          shell_word(file)));
}

void print_mounting(const calib::Robot& robot) {
  const Eigen::Vector3d up = calib::up_of(robot);
  if (!up.isApprox(Eigen::Vector3d::UnitZ(), kSameDirection))
    fmt::print(
        stderr,
        "mounting: gravity along {} of the arm's foot, which does not stand on a floor. Check it\n",
        direction_words(-up));
}

ToolForm tool_of(const MachineData& data, int number) {
  const std::string name = tool_name(data, number);
  const auto stated = data.tools.find(number);
  if (stated == data.tools.end())
    throw calib::FileError(fmt::format(
        "{}: not in the given files. {}", name,
        data.tools.empty() ? "Give the controller's $config.dat (KRC:\\R1\\System), or its backup"
                           : measured_words(data)));
  const auto refuse = [&](const char* why) {
    throw calib::FileError(
        fmt::format("{}: {} {}. {}", data.tool_places.at(number), name, why, measured_words(data)));
  };
  if (is_empty(stated->second)) refuse("is empty (X, Y, Z, A, B, C all 0)");
  if (data.fixed_tools.count(number) > 0)
    refuse("stands in the cell (TOOL_TYPE #TCP), not on the flange");
  ToolForm tool{.xyz_mm = stated->second.xyz_mm, .abc_deg = stated->second.abc_deg};
  const auto load = data.loads.find(number);
  if (load == data.loads.end() || !(load->second.mass_kg > 0.0)) return tool;
  tool.mass_kg = load->second.mass_kg;
  if (!is_zero(load->second.com_mm)) tool.com_mm = load->second.com_mm;
  return tool;
}

std::vector<int> measured_tools(const MachineData& data) {
  std::vector<int> numbers;
  for (const auto& [number, frame] : data.tools)
    if (!is_empty(frame) && data.fixed_tools.count(number) == 0) numbers.push_back(number);
  return numbers;
}

std::string tool_list(const MachineData& data) {
  std::string list;
  for (const int number : measured_tools(data))
    list += (list.empty() ? "" : ", ") + named(std::to_string(number), number, data.tool_names);
  return list;
}

std::vector<std::string> frame_lines(const MachineData& data) {
  std::vector<std::string> lines;
  for (const int number : measured_tools(data)) {
    lines.push_back(tool_name(data, number) + ", as [tool]:");
    for (const auto& [key, value] : tool_keys(tool_of(data, number)))
      lines.push_back(fmt::format("  {} = {}", key, value));
  }
  for (const auto& [number, stated] : data.bases) {
    if (is_empty(stated)) continue;
    lines.push_back(named(fmt::format("BASE_DATA[{}]", number), number, data.base_names) +
                    (data.robroot ? ", in the robot's base frame:"
                                  : ", in the world ($ROBROOT is not in the given files):"));
    const FrameMmDeg base = rounded(in_the_arms_base(data, stated));
    for (const auto& [key, value] : tool_keys({.xyz_mm = base.xyz_mm, .abc_deg = base.abc_deg}))
      lines.push_back(fmt::format("  {} = {}", key, value));
  }
  return lines;
}

}  // namespace cellcal::daemon
