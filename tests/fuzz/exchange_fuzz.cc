// Any bytes as a URDF and as machine data: refused with FileError, or read as valid numbers.
// Also replayed over exchange_corpus as an ordinary test.

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string_view>

#include "calib/export/machine_data.h"
#include "calib/export/rigid_arm.h"
#include "calib/export/urdf.h"
#include "calib/files/text.h"
#include "calib/model/error.h"

namespace {

using namespace cellcal::calib;  // NOLINT: a fuzz target's own file

void require(bool condition, const char* what) {
  if (condition) return;
  std::fprintf(stderr, "broken promise: %s\n", what);
  std::abort();
}

/// Lengths of a KR 6.
void compare(const Robot& robot) {
  MachineData data;
  data.base = FrameMmDeg{{0, 0, 400}, {}};
  data.length_a_m = 0.025;
  data.length_b_m = 0.455;
  data.wrist = FrameMmDeg{{420, 0, 35}, {0, 90, 0}};
  data.flange = FrameMmDeg{{0, 0, 80}, {}};
  const auto zeros = controllers_zeros(data, robot);
  if (!zeros) return;
  require(zeros->joints.size() == robot.joints.size(), "a zero for each joint");
  for (const JointZero& one : zeros->joints)
    require(std::isfinite(one.zero_rad), "zeros are finite");
}

void read_as_urdf(std::string_view text) {
  UrdfChain chain;
  try {
    chain = read_urdf(text, "fuzz.urdf");
  } catch (const FileError&) {
    return;
  }
  require(!chain.frames.joints.empty(), "a joint turns");
  for (const PlacedJoint& joint : chain.frames.joints) {
    require(joint.origin.matrix().allFinite(), "frames are finite");
    require(std::abs(joint.axis.norm() - 1.0) < 1e-9, "axes are unit");
    require(std::isfinite(joint.min_rad) && std::isfinite(joint.max_rad), "limits are finite");
  }
  for (std::size_t i = 1; i < chain.frames.joints.size(); ++i)
    require(!chain.frames.joints[i].slides, "the first joint alone slides");
  if (chain.frames.joints.front().slides) return;
  const Robot robot = robot_of(chain.frames);
  require(robot.joints.size() == chain.frames.joints.size(), "an arm of them");
  compare(robot);
}

void read_as_machine_data(std::string_view text) {
  MachineData data;
  try {
    read_machine_data(text, "fuzz.dat", data);
  } catch (const FileError&) {
    return;
  }
  for (const MachineAxis& axis : data.axes)
    for (const auto& value : {axis.min_rad, axis.max_rad, axis.max_speed_rad_s})
      require(!value || std::isfinite(*value), "limits are finite");
  for (const auto& [number, tool] : data.tools)
    for (const double value : tool.xyz_mm) require(std::isfinite(value), "tools are finite");
  for (const auto& [number, load] : data.loads) {
    require(std::isfinite(load.mass_kg), "loads are finite");
    for (const double value : load.com_mm) require(std::isfinite(value), "centres are finite");
  }
  for (const auto* names : {&data.tool_names, &data.base_names})
    for (const auto& [number, name] : *names)
      require(!name.empty() && !has_control(name), "names are fit for a comment");
  try {
    if (const auto unit = linear_unit_of(data.external, data.robroot)) {
      require(std::abs(unit->guide->along.norm() - 1.0) < 1e-6, "travels along a direction");
      require(unit->min_rad < unit->max_rad, "travels");
    }
  } catch (const FileError&) {  // incomplete, or other kinematics
  }
  try {
    for (const PositionerAxis& axis : positioner_of(data.external, data.robroot)) {
      require(axis.frame.matrix().allFinite(), "axes of a positioner are somewhere");
      require(axis.min_rad < axis.max_rad, "axes of a positioner turn");
    }
  } catch (const FileError&) {  // incomplete, or other kinematics
  }
  try {
    for (const Joint& joint : robot_of(data).joints) {
      require(std::isfinite(joint.d_m) && std::isfinite(joint.a_m), "lengths are finite");
      require(joint.min_rad < joint.max_rad, "limits are in order");
    }
  } catch (const FileError&) {  // another kind of arm, or incomplete
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  read_as_urdf(text);
  read_as_machine_data(text);
  return 0;
}
