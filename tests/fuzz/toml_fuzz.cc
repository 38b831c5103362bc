// Any text as a robot or cell file: refused with FileError, or read such that its written form
// reads the same again. Also replayed over toml_corpus as an ordinary test.

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <string_view>

#include "calib/files/cell_file.h"
#include "calib/files/files.h"
#include "calib/files/toml.h"
#include "calib/model/kinematics.h"

namespace {

using namespace cellcal::calib;  // NOLINT: a fuzz target's own file

constexpr std::size_t kLargest = 1 << 16;

void require(bool condition, const char* what) {
  if (condition) return;
  std::fprintf(stderr, "broken promise: %s\n", what);
  std::abort();
}

void as_robot(std::string_view text) {
  Robot robot;
  try {
    robot = read_robot(TomlTable::parse(text, "fuzz.toml"));
  } catch (const FileError&) {
    return;
  }
  const ArmModel arm(robot, Tool{});
  const std::vector<double> zero(robot.joints.size(), 0.0);
  require(arm.nominal_tcp(zero).matrix().allFinite(), "an arm that was read has a finite TCP");
  const std::vector<double> turned(robot.positioner.size(), 0.5);
  require(arm.nominal_tcp(zero, 0, turned).matrix().allFinite(),
          "nor does a positioner make it other");
  const std::string once = robot_to_toml(robot);
  const std::string twice = robot_to_toml(read_robot(TomlTable::parse(once, "once.toml")));
  require(read_robot(TomlTable::parse(twice, "twice.toml")).joints.size() == robot.joints.size(),
          "a robot that was read can be written and read");
  require(!robot_to_toml(read_robot(table_from_json(toml_to_json(once), "once.json"))).empty(),
          "a robot that was read can go through JSON");
}

void as_cell(std::string_view text) {
  static const Robot kRobot = [] {
    Robot robot;
    robot.joints.resize(1);
    robot.joints[0].name = "A1";
    robot.positioner.resize(2);
    robot.positioner[0].name = "E1";
    robot.positioner[1].name = "E2";
    return robot;
  }();
  Cell cell;
  try {
    cell = read_cell(TomlTable::parse(text, "fuzz.toml"), kRobot);
  } catch (const FileError&) {
    return;
  }
  const std::string once = cell_to_toml(cell, "r.toml");
  const Cell again = read_cell(TomlTable::parse(once, "once.toml"), kRobot);
  require(
      again.targets.size() == cell.targets.size() && again.lengths.size() == cell.lengths.size(),
      "a cell that was read can be written and read");
  require(again.other_tools.size() == cell.other_tools.size() && again.tool.id == cell.tool.id,
          "tools survive");
  require(again.obstacles.size() == cell.obstacles.size() &&
              again.floor_m.has_value() == cell.floor_m.has_value(),
          "what stands in the way survives");
  for (std::size_t i = 0; i < cell.targets.size(); ++i)
    require(again.targets[i].id == cell.targets[i].id &&
                again.targets[i].carried_by == cell.targets[i].carried_by,
            "ids and what carries the targets survive");
  (void)read_cell(table_from_json(toml_to_json(once), "once.json"), kRobot);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), std::min(size, kLargest));
  as_robot(text);
  as_cell(text);
  return 0;
}
