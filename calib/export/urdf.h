#pragma once
// The Unified Robot Description Format (ROS, wiki.ros.org/urdf/XML): metres and radians.

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "calib/export/rigid_arm.h"

namespace cellcal::calib {

/// Larger documents are refused.
inline constexpr std::size_t kMostUrdfBytes = 16u << 20;

/// A generated URDF: base_link, link_1 ..., flange, tcp, and of a positioner positioner_1 ... from
/// base_link; no shapes. Joints are named as in the robot file, in lower case with the prefix "joint_".
/// `comment` forms the header.
std::string urdf_of(const JointFrames& frames, const std::string& robot_name,
                    const std::string& comment);

struct UrdfChain {
  std::string robot_name, base_link, tip_link;
  /// The flange is the frame of `tip_link`. Joint names are the file's.
  JointFrames frames;
  /// Of base_link in the file's link "world", which gravity is along -z of, joints between them at 0; else none.
  Eigen::Matrix3d mounted = Eigen::Matrix3d::Identity();
  /// The tip is the link that the last joint moves, on whose axis a calibrated flange need not lie.
  bool ends_at_joint = false;
  // Facts for the user, by the names in the file.
  /// Continuous joints without limits: a turn to either side is taken.
  std::vector<std::string> unlimited = {};
  /// Joints after the last one: a gripper's.
  std::vector<std::string> behind = {};
  /// Links fixed to the last joint where none is named as flange, and their place in the frame of tip_link.
  std::vector<std::pair<std::string, Eigen::Isometry3d>> other_flanges = {};
  /// Joint of the chain, and the joint that mimics it: the rod of a parallel linkage.
  std::vector<std::pair<std::string, std::string>> followed = {};
};

/// Links at the ends of the arm; empty: chosen as read_urdf() describes.
struct UrdfEnds {
  std::string tip = {}, root = {};
};

/// The chain of turning joints from root to tip, the first of which may be prismatic: a linear unit. By
/// default the tip is the end of the longest chain, which ends at a "tool0" that it passes and before a
/// gripper: joints at its end that slide, mimic, or are mimicked by their neighbours. Among links that differ by
/// fixed joints only, "tool0", otherwise "flange", with or without a prefix, otherwise the first in the file. The root is
/// that of the file; a root "world" is skipped: the arm begins at the link fixed to it. Messages name
/// the file `name`. Throws FileError.
UrdfChain read_urdf(std::string_view text, const std::string& name, const UrdfEnds& ends = {});

/// The link that calibrated_urdf() adds for the flange; empty: the tip is it.
std::string calibrated_flange(const UrdfChain& chain);

/// The given URDF with its chain's joints at their calibrated places, and the positioner from the chain's
/// base. Where the chain ends at its last joint's own link, the calibrated flange is a further link fixed to it.
/// Throws FileError, also where a joint or link has the name of one of the positioner's, or of that link.
std::string calibrated_urdf(std::string_view text, const std::string& name, const UrdfEnds& ends,
                            const RigidArm& nominal, const RigidArm& calibrated,
                            const std::string& comment);

}  // namespace cellcal::calib
