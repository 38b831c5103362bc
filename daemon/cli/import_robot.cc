// Robots that a cell file may name.

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>
#include <system_error>
#include <tuple>
#include <utility>

#include "calib/estimate/external_axes.h"
#include "calib/export/machine_data.h"
#include "calib/export/machine_external.h"
#include "calib/export/rigid_arm.h"
#include "calib/export/tables.h"
#include "calib/export/urdf.h"
#include "calib/files/cell_file.h"
#include "calib/files/files.h"
#include "calib/files/input_file.h"
#include "calib/files/text.h"
#include "calib/model/error.h"
#include "calib/model/units.h"
#include "calib/plan/cell_check.h"
#include "daemon/cell_form/cell_text.h"
#include "daemon/cli/backup.h"
#include "daemon/cli/controller_data.h"
#include "daemon/cli/offline.h"
#include "daemon/files/atomic_file.h"
#include "daemon/files/child.h"

namespace cellcal::daemon {

namespace {

/// The last lines, which name file and line of the fault.
std::string end_of(const std::string& text, std::size_t most_lines) {
  std::vector<std::string> lines;
  std::istringstream all(text);
  for (std::string line; std::getline(all, line);)
    if (!calib::trimmed(line).empty()) lines.push_back(calib::shown(calib::trimmed(line), 300));
  std::string words;
  for (std::size_t i = lines.size() - std::min(lines.size(), most_lines); i < lines.size(); ++i)
    words += (words.empty() ? "" : "; ") + lines[i];
  return words;
}

/// The file's text; a .xacro expanded by the program of that name, where it is installed.
/// `arguments`: NAME:=VALUE each.
std::string urdf_text(const std::filesystem::path& urdf,
                      const std::vector<std::string>& arguments) {
  constexpr std::chrono::seconds kLimit{30};
  std::string text = calib::read_file(urdf, calib::kMostUrdfBytes);
  if (urdf.extension() != ".xacro") return text;
  std::vector<std::string> words{"xacro", std::filesystem::absolute(urdf).string()};
  words.insert(words.end(), arguments.begin(), arguments.end());
  const ChildEnd end =
      run_child({.words = words, .limit = kLimit, .most_output = calib::kMostUrdfBytes});
  switch (end.why) {
    case ChildEnd::Why::kNotStarted:
      return text;  // the reader refuses it by line, with the command that expands it
    case ChildEnd::Why::kTooLong:
      throw calib::FileError(urdf.string(),
                             fmt::format(": xacro did not end within {} s", kLimit.count()));
    case ChildEnd::Why::kTooMuch:
      throw calib::FileError(urdf.string(), fmt::format(": xacro writes more than {} MB",
                                                        calib::kMostUrdfBytes >> 20));
    case ChildEnd::Why::kEnded: break;
  }
  if (end.status != 0)
    throw calib::FileError(urdf.string(), ": xacro: " + (end.err.empty() ? "failed without a reason"
                                                                         : end_of(end.err, 4)));
  if (const std::string told = end_of(end.err, 4); !told.empty())
    fmt::print(stderr, "warning: xacro: {}\n", told);
  return end.out;
}

std::string quoted(const std::vector<std::string>& names) {
  constexpr std::size_t kMost = 6;
  std::string words;
  for (std::size_t i = 0; i < std::min(names.size(), kMost); ++i)
    words += fmt::format("{}\"{}\"", i == 0 ? "" : ", ", calib::shown(names[i]));
  return words + (names.size() > kMost ? fmt::format(" and {} more", names.size() - kMost) : "");
}

void print_chain(const calib::UrdfChain& chain) {
  fmt::print(stderr,
             "chain \"{}\" to \"{}\", {} joints. Check joint senses and zeros against the "
             "pendant before use\n",
             calib::shown(chain.base_link), calib::shown(chain.tip_link),
             chain.frames.joints.size());
  if (!chain.behind.empty())
    fmt::print(stderr, "left out behind the flange: {}\n", quoted(chain.behind));
  if (!chain.other_flanges.empty()) {
    constexpr std::size_t kMost = 4;
    std::string links;
    for (std::size_t i = 0; i < std::min(chain.other_flanges.size(), kMost); ++i) {
      const auto& [link, place] = chain.other_flanges[i];
      const Eigen::Vector3d at =
          ((place.translation() * calib::kMmPerM * 10.0).array().round() / 10.0).matrix();
      links +=
          fmt::format("{}\"{}\" ({:g} {:g} {:g} mm from it, turned by {:.1f} deg)",
                      i == 0 ? "" : ", ", calib::shown(link), at.x() + 0.0, at.y() + 0.0,
                      at.z() + 0.0, Eigen::AngleAxisd(place.linear()).angle() * calib::kDegPerRad);
    }
    if (chain.other_flanges.size() > kMost)
      links += fmt::format(" and {} more", chain.other_flanges.size() - kMost);
    fmt::print(
        stderr,
        "warning: no link is named tool0 or flange: \"{}\" is taken for the flange. Also fixed to the last "
        "joint: {}. The tool is stated from the controller's flange: --tip LINK takes another\n",
        calib::shown(chain.tip_link), links);
  }
  for (const std::string& joint : chain.unlimited)
    fmt::print(
        stderr,
        "warning: joint \"{}\" turns without limits: -360 to 360 deg are taken. State the controller's "
        "in min_deg and max_deg\n",
        calib::shown(joint));
  if (!chain.followed.empty())
    fmt::print(
        stderr,
        "warning: joint \"{}\" is mimicked by \"{}\", a parallel linkage. Its angle has to be that against the "
        "link before it: where the controller shows it against the base, add or subtract the joint's before it in "
        "each table\n",
        calib::shown(chain.followed.front().first), calib::shown(chain.followed.front().second));
}

/// And the names that its joints have in the URDF.
std::pair<calib::Robot, std::vector<std::string>> from_urdf(const ImportRobotCommand& command) {
  const std::string name = command.urdf.string();
  const calib::UrdfChain chain =
      calib::read_urdf(urdf_text(command.urdf, command.xacro_arguments), name, command.ends);
  if (chain.frames.joints.front().slides)
    throw calib::FileError(
        name,
        fmt::format(
            ": joint \"{}\" slides. Take the arm behind it (--root LINK, its base), and state the "
            "linear unit as the robot file's first [[joint]], kind = \"prismatic\"",
            chain.frames.joints.front().name));
  calib::Robot robot = calib::robot_of(chain.frames);
  robot.gravity_m_s2 = chain.mounted.transpose() * robot.gravity_m_s2;
  robot.name = chain.robot_name.empty() ? "robot" : chain.robot_name;
  robot.source = command.urdf.filename().string();
  std::vector<std::string> names;
  for (calib::Joint& joint : robot.joints) {
    names.push_back(joint.name);
    joint.name = calib::robot_joint_name(joint.name);
  }
  calib::set_usual_tolerances(robot);
  print_chain(chain);
  return {std::move(robot), std::move(names)};
}

void print_differences(const calib::MachineData& data, const calib::Robot& robot) {
  for (const calib::LengthDifference& one : calib::differences(data, robot))
    fmt::print(stderr, "{}",
               one.variable.empty()
                   ? fmt::format("warning: {:.3f} mm between the flanges of machine data and robot "
                                 "file. Check the robot's type and choose its file\n",
                                 one.robot_m * calib::kMmPerM)
                   : fmt::format(
                         "warning: {} {:.3f} mm in the controller, {:.3f} mm in the robot file ({} "
                         "of {}). Check the robot's type and choose its file\n",
                         one.variable, one.controller_m * calib::kMmPerM,
                         one.robot_m * calib::kMmPerM, one.key, one.joint));
}

/// Angles counted otherwise than by the controller send the arm elsewhere. Throws calib::FileError for them.
void refuse_other_zeros(const calib::MachineData& data, const calib::Robot& robot,
                        const std::string& file) {
  const auto zeros = calib::controllers_zeros(data, robot);
  if (!zeros || zeros->same()) return;
  std::string all;
  for (std::size_t i = 0; i < zeros->joints.size(); ++i) {
    const calib::JointZero& one = zeros->joints[i];
    if (one.same()) continue;
    all += fmt::format("{}: zero {:.2f} deg from the controller's{}; ",
                       calib::shown(robot.joints[robot.first_turning() + i].name),
                       one.zero_rad * calib::kDegPerRad + 0.0,
                       one.sense < 0 ? ", opposite sense" : "");
  }
  if (all.empty())
    all = fmt::format("flange: turned by {:.3f} deg against the controller's; ",
                      zeros->flange_rad * calib::kDegPerRad);
  throw calib::FileError(
      file, ": " + all +
                "the arm would move to other places. Leave this file out (machine data give the "
                "whole arm), or correct its joints' zeros and axes (a flange's: --tip)");
}

/// The controller's are taken.
void print_limits(const calib::MachineData& data, const calib::Robot& robot) {
  constexpr double kSameDeg = 0.1;
  const std::size_t first = robot.first_turning();
  for (std::size_t i = 0; i < std::min(robot.joints.size() - first, data.axes.size()); ++i) {
    const calib::Joint& joint = robot.joints[first + i];
    const double low = data.axes[i].min_rad.value_or(joint.min_rad) * calib::kDegPerRad,
                 high = data.axes[i].max_rad.value_or(joint.max_rad) * calib::kDegPerRad,
                 low_here = joint.min_rad * calib::kDegPerRad,
                 high_here = joint.max_rad * calib::kDegPerRad;
    if (std::abs(low - low_here) < kSameDeg && std::abs(high - high_here) < kSameDeg) continue;
    fmt::print(stderr,
               "warning: {}: limits {:.3f} to {:.3f} deg in the URDF, {:.3f} to {:.3f} deg in the "
               "controller, which are taken\n",
               calib::shown(joint.name), low_here, high_here, low, high);
  }
}

void print_accuracy(const calib::Robot& robot) {
  if (robot.absolute_accuracy != calib::AbsoluteAccuracy::kActive) return;
  fmt::print(stderr,
             "warning: $ABS_ACCUR: absolute accuracy is active, and the controller computes with a "
             "measured model of this arm that machine data do not hold. 'cellcal correct' refuses "
             "programs for it: switch the option off on the controller ($DEACTIVATE_ABS_ACCUR) and "
             "import again, or put the measured lengths into the robot file and write "
             "absolute_accuracy = \"in this file\"\n");
}

/// Throws for joints as of a URDF in wrong units or without limits or speed. `names`: the URDF's.
void check_joints(const calib::Robot& robot, const std::vector<std::string>& names,
                  const std::string& file) {
  constexpr double kMostTurnsRad = 25.0, kLongestM = 50.0, kFastestRadS = 35.0;
  const auto fail = [&](const calib::Joint& joint, const std::string& what) {
    const std::string& name = names.at(static_cast<std::size_t>(&joint - robot.joints.data()));
    throw calib::FileError(file, ": joint \"" + calib::shown(name) + "\": " + what);
  };
  for (const calib::Joint& joint : robot.joints) {
    if (std::max(std::abs(joint.d_m), std::abs(joint.a_m)) > kLongestM)
      fail(joint, fmt::format("a length of {:.0f} m. A URDF is in metres, not millimetres",
                              std::max(std::abs(joint.d_m), std::abs(joint.a_m))));
    if (std::max(std::abs(joint.min_rad), std::abs(joint.max_rad)) > kMostTurnsRad)
      fail(joint, fmt::format("limits {:.1f} to {:.1f} rad. A URDF is in radians, not degrees",
                              joint.min_rad, joint.max_rad));
    if (!(joint.min_rad < joint.max_rad))
      fail(joint,
           fmt::format("limits {:.3f} to {:.3f} deg, the lower not below the upper. Give "
                       "<limit lower upper>, or the controller's with --machine-data",
                       joint.min_rad * calib::kDegPerRad, joint.max_rad * calib::kDegPerRad));
    if (joint.max_speed_rad_s > kFastestRadS)
      fail(joint,
           fmt::format("velocity {:g} rad/s: no arm's. A URDF is in rad/s, not deg/s; give the "
                       "data sheet's, or --machine-data",
                       joint.max_speed_rad_s));
    if (!(joint.max_speed_rad_s > 0.0))
      fail(joint, "no speed. Give <limit velocity>, or the controller's data with --machine-data");
  }
}

/// Another geometry than a URDF's, before limits and speeds of the machine data.
calib::Robot geometry(const ImportRobotCommand& command, const calib::MachineData& data) {
  if (!command.robot.empty()) return calib::load_named_robot(command.robot.string());
  if (!has_an_arm(data))
    throw calib::FileError(
        "no lengths of an arm in the machine data. Give $machine.dat of KRC:\\R1\\Mada (that of "
        "STEU is the controller's), the backup, or --robot or --urdf");
  return calib::arm_of_controller(data);
}

/// Puts TOOL_DATA[n] into the cell file, which is kept as NAME.before.
void put_tool(const ImportRobotCommand& command, const calib::MachineData& data) {
  const ToolForm tool = tool_of(data, command.tool);
  const calib::CellText before = calib::read_cell_text(command.cell);
  const calib::Robot robot = calib::parse_cell(before).robot;
  try {
    if (has_an_arm(data)) print_differences(data, robot);
  } catch (const calib::FileError& other) {  // TOOL_DATA is from the flange of any arm
    fmt::print(stderr, "warning: {}. Lengths are not compared\n", other.what());
  }
  compare_mounting(data, robot, before.robot_name, false);
  calib::CellText after = before;
  after.cell_text = with_tool(before.cell_text, before.cell_name, tool);
  const calib::Cell cell = calib::parse_cell(after);
  const calib::FrameMmDeg is{tool.xyz_mm, tool.abc_deg};
  if (!cell.tool.tcp.isApprox(calib::to_isometry(is), 1e-9))
    throw calib::FileError(before.cell_name, ": [tool] could not be set (not written)");
  for (const calib::Phrase& warning : calib::refuse_faulty(cell))
    fmt::print(stderr, "warning: {}\n", words(warning));
  write_atomically(command.cell.string() + ".before", before.cell_text);
  write_atomically(command.cell, after.cell_text);
  fmt::print(stderr, "{}: [tool] is TOOL_DATA[{}]{}; the file before: {}.before\n",
             command.cell.string(), command.tool,
             tool.mass_kg
                 ? fmt::format(" with its load of {:g} kg", *tool.mass_kg)
                 : fmt::format(". LOAD_DATA[{}] has no mass: mass_kg = {:g} stays, check it",
                               command.tool, cell.tool.mass_kg),
             command.cell.string());
}

std::string rigid_words(const calib::OmittedEffects& out) {
  return fmt::format(
      "{:.3f} mm mean, {:.3f} mm max over the workspace: effect of compliance, gears and bending, "
      "which rigid links cannot hold",
      out.mean_m * calib::kMmPerM, out.max_m * calib::kMmPerM);
}

/// Properties of a positioner that the form does not hold, a line each; empty without one.
std::string positioner_words(const ExportRobotCommand& command, const calib::Calibration& c) {
  std::string words;
  for (std::size_t j = 0; j < c.cell.robot.positioner.size(); ++j) {
    const std::string& name = c.cell.robot.positioner[j].name;
    const double scale = correction_of(c, positioner_parameter(j, calib::AxisError::kScale));
    const double give = calib::largest_give_rad(c, j);
    words +=
        command.as == "dh"
            ? fmt::format(
                  "\n{} of the positioner: not in a table of the arm; --as urdf, yaml, "
                  "json and kuka have it",
                  name)
            : fmt::format(
                  "\n{} of the positioner: scale of its angle {:+.3f} mrad/rad{}, not in "
                  "its joint",
                  name, 1e3 * scale,
                  give > 0.0 ? fmt::format(" and {:.3f} mrad that it gives at most under its load",
                                           1e3 * give)
                             : "");
  }
  return words;
}

/// Properties of a linear unit that the form lacks; empty without one.
std::string unit_words(const ExportRobotCommand& command, const calib::Calibration& c) {
  if (c.cell.robot.first_turning() == 0) return {};
  const bool arm_alone = command.as == "dh";
  const calib::OmittedEffects out = calib::left_out_of_unit(c, !arm_alone);
  return fmt::format(
      "\n{} carries the arm: {}: {:.3f} mm mean, {:.3f} mm max over the workspace{}",
      c.cell.robot.joints.front().name,
      arm_alone
          ? "not in a table of the arm; driven as drawn it costs"
          : "its joint has the direction found; scale, straightness, roll, pitch and yaw, which a joint "
            "cannot hold",
      out.mean_m * calib::kMmPerM, out.max_m * calib::kMmPerM,
      command.as == "yaml"
          ? ", are the table below (a frame after that joint, linear between its rows)"
          : "; --as json and yaml have them");
}

std::string comment(const ExportRobotCommand& command, const calib::Calibration& calibration,
                    const calib::OmittedEffects& out) {
  return fmt::format("calibrated {}, from {}\n{}{}", calibration.cell.robot.name,
                     command.calibration.filename().string(), rigid_words(out),
                     unit_words(command, calibration) + positioner_words(command, calibration));
}

struct Listed {
  std::filesystem::path file;
  std::string model;
  std::size_t joints = 0;
  std::optional<double> reach_m;
  std::string wrong;  ///< why the file cannot be read; empty: readable
};

/// Distance from the axis of A1 to the wrist centre of the stretched arm, as in KUKA's data sheets;
/// nullopt for other structures.
std::optional<double> reach_m(const calib::Robot& robot) {
  constexpr std::size_t kAxes = 6;
  if (robot.joints.size() != kAxes) return std::nullopt;
  const auto& j = robot.joints;
  return std::abs(j[0].a_m) + std::abs(j[1].a_m) + std::hypot(j[2].a_m, j[3].d_m);
}

/// By name; of duplicates the one found first.
std::map<std::string, Listed> all_robots() {
  std::map<std::string, Listed> robots;
  for (const std::filesystem::path& folder : calib::robots_directories()) {
    std::error_code none;
    for (std::filesystem::directory_iterator at(folder, none), end; !none && at != end;
         at.increment(none)) {
      if (at->path().extension() != ".toml") continue;
      const auto [one, is_new] = robots.try_emplace(at->path().stem().string());
      if (!is_new) continue;
      one->second.file = at->path();
      try {
        const calib::Robot robot = calib::load_robot(at->path());
        one->second.model = robot.name;
        one->second.joints = robot.joints.size();
        one->second.reach_m = reach_m(robot);
      } catch (const calib::FileError& wrong) {
        one->second.wrong = wrong.what();
      }
    }
  }
  return robots;
}

bool is_own(const std::filesystem::path& file) {
  const char* set = std::getenv("CELLCAL_ROBOTS");
  std::error_code none;
  return set != nullptr && *set != '\0' &&
         std::filesystem::equivalent(file.parent_path(), set, none);
}

std::string as_json(const std::map<std::string, Listed>& robots) {
  nlohmann::json list = nlohmann::json::array(), places = nlohmann::json::array();
  for (const auto& [name, one] : robots)
    list.push_back(
        {{"name", name},
         {"model", one.model},
         {"joints", one.joints},
         {"reach_mm",
          one.reach_m ? nlohmann::json(*one.reach_m * calib::kMmPerM) : nlohmann::json(nullptr)},
         {"own", is_own(one.file)},
         {"file", one.file.string()},
         {"error", one.wrong.empty() ? nlohmann::json(nullptr) : nlohmann::json(one.wrong)}});
  for (const auto& folder : calib::robots_directories()) places.push_back(folder.string());
  return nlohmann::json{{"robots", list}, {"looked_for_in", places}}.dump(
             1, ' ', false, nlohmann::json::error_handler_t::replace) +
         "\n";
}

}  // namespace

int import_robot(const ImportRobotCommand& command) {
  const calib::MachineData data = read_machine_files(command.machine_data);
  if (!command.cell.empty()) put_tool(command, data);
  if (!command.cell.empty() && command.output.empty()) return kSuccess;
  std::vector<std::string> names;
  calib::Robot robot;
  if (!command.urdf.empty())
    std::tie(robot, names) = from_urdf(command);
  else
    robot = geometry(command, data);
  if (!command.machine_data.empty()) {
    if (!command.urdf.empty() || !command.robot.empty()) {
      const std::string file = (command.urdf.empty() ? command.robot : command.urdf).string();
      refuse_other_zeros(data, robot, file);
      print_differences(data, robot);
      compare_mounting(data, robot, file, true);
    }
    if (!command.urdf.empty()) print_limits(data, robot);
    robot = calib::with_machine_data(std::move(robot), data);
    if (!data.type().empty()) robot.source += (robot.source.empty() ? "" : "; ") + data.type();
    for (const std::string& line : frame_lines(data)) fmt::print(stderr, "{}\n", line);
    print_accuracy(robot);
  }
  if (!command.urdf.empty()) check_joints(robot, names, command.urdf.string());
  robot = with_external_axes(std::move(robot), data);
  print_mounting(robot);
  put_as(as_robot, calib::robot_to_toml(robot), command.output);
  return kSuccess;
}

int export_robot(const ExportRobotCommand& command) {
  const auto usable = usable_calibration("export-robot", command.calibration, command.withheld);
  if (!usable) return kNotPublishable;
  const calib::Calibration& calibration = *usable;
  if (command.as == "json") {
    put(calib::arm_json(calibration), command.output);
    return kSuccess;
  }
  if (command.as == "kuka") {
    put(calib::external_kinematic_lines(calibration), command.output);
    return kSuccess;
  }
  const calib::RigidArm nominal = calib::nominal_rigid_arm(calibration.cell);
  const calib::RigidArm real = calib::nearest_rigid_arm(calibration);
  const calib::OmittedEffects out = calib::left_out(calibration, real);
  const std::string words = comment(command, calibration, out);
  std::string text;
  const auto yaml = [&](const calib::JointFrames& frames) {
    return calib::ros_yaml(frames, words) + calib::unit_yaml(calibration, frames.joints.front());
  };
  if (command.as == "dh") {
    text = calib::dh_csv(nominal, real);
  } else if (command.urdf.empty()) {
    const calib::JointFrames frames = calib::joint_frames(real);
    text = command.as == "urdf" ? calib::urdf_of(frames, calibration.cell.robot.name, words)
                                : yaml(frames);
  } else {
    const std::string given = urdf_text(command.urdf, {});
    const std::string name = command.urdf.string();
    const calib::UrdfChain chain = calib::read_urdf(given, name, command.ends);
    if (const std::string link = calib::calibrated_flange(chain);
        command.as == "urdf" && !link.empty())
      fmt::print(
          stderr,
          "warning: link \"{}\" lies on the last joint's axis, which cannot hold the flange's own error: the "
          "calibrated flange is the added link \"{}\"\n",
          calib::shown(chain.tip_link), calib::shown(link));
    text = command.as == "urdf"
               ? calib::calibrated_urdf(given, name, command.ends, nominal, real, words)
               : yaml(calib::moved_frames(chain.frames, nominal, real));
  }
  if (command.as == "urdf")
    read_back(text, command.output, [&](const auto& urdf, const auto& its_name) {
      calib::read_urdf(urdf, its_name, command.ends);
    });
  put(text, command.output);
  fmt::print(stderr, "left out: {}. Where that is too much, correct poses: cellcal correct{}\n",
             rigid_words(out),
             unit_words(command, calibration) + positioner_words(command, calibration));
  return kSuccess;
}

int robots(const RobotsCommand& command) {
  const std::map<std::string, Listed> all = all_robots();
  if (command.json) {
    put(as_json(all), {});
    return kSuccess;
  }
  std::string text = fmt::format("{:<24}{:<30}{:>6}{:>10}\n", "name", "model", "axes", "reach");
  for (const auto& [name, one] : all) {
    if (!one.wrong.empty()) {
      text += fmt::format("{:<24}cannot be read: {}\n", name, one.wrong);
      continue;
    }
    const std::string reach =
        one.reach_m ? fmt::format("{:.0f} mm", *one.reach_m * calib::kMmPerM) : "-";
    text += fmt::format("{:<24}{:<30}{:>6}{:>10}{}\n", name, one.model, one.joints, reach,
                        is_own(one.file) ? "  own" : "");
  }
  text +=
      "looked for in this order (a folder of your own first: environment variable CELLCAL_ROBOTS):\n";
  for (const auto& folder : calib::robots_directories()) text += "  " + folder.string() + "\n";
  put(text, {});
  return kSuccess;
}

}  // namespace cellcal::daemon
