#include "tests/experiments/happening.h"

#include <fmt/format.h>

namespace cellcal::experiments {

using calib::ChangeKind;

namespace {

Eigen::Vector3d any_direction(calib::Random& random) {
  const Eigen::Vector3d d(random.normal(), random.normal(), random.normal());
  return d.normalized();
}

}  // namespace

std::string name_of(const Happening& happening) {
  if (happening.kind == ChangeKind::kNothing) return "nothing";
  if (happening.kind == ChangeKind::kGrowth)
    return fmt::format("growth {:.0f} ppm", happening.size * 1e6);
  return fmt::format("{} {:.2f} {}", to_string(happening.kind), happening.size * 1e3,
                     happening.kind == ChangeKind::kJoint ? "mrad" : "mm");
}

Happened happen(const Happening& happening, World& world, calib::Random& random) {
  Happened happened;
  switch (happening.kind) {
    case ChangeKind::kTool:
      happened.tool_shift_m = happening.size * any_direction(random);
      world.arm.knock(happened.tool_shift_m);
      break;
    case ChangeKind::kSphere: {
      const std::size_t sphere = random.below(world.cell.targets.size());
      world.centre_m[sphere] += happening.size * any_direction(random);
      happened.which = world.cell.targets[sphere].id;
      break;
    }
    case ChangeKind::kJoint: {
      const std::size_t joint = random.below(world.cell.robot.joints.size() - 1);
      world.arm.slip(joint, random.uniform() < 0.5 ? happening.size : -happening.size);
      happened.which = world.cell.robot.joints[joint].name;
      break;
    }
    case ChangeKind::kGrowth:
      world.arm.grow(random.uniform() < 0.5 ? happening.size : -happening.size);
      break;
    case ChangeKind::kPositioner:  // not in these worlds
    case ChangeKind::kNothing:
    case ChangeKind::kTouch: break;
  }
  return happened;
}

}  // namespace cellcal::experiments
