#pragma once
// Numbers and names in the texts of other programs, whatever the locale.

#include <Eigen/Core>
#include <optional>
#include <string>
#include <string_view>

namespace cellcal::calib {

/// Comes back bit for bit.
std::string shortest(double value);
/// Three, with blanks between them.
std::string shortest(const Eigen::Vector3d& values);

/// The whole text, blanks about it aside; nothing where it is none, or not finite.
std::optional<double> number(std::string_view text);
std::optional<Eigen::Vector3d> three_numbers(std::string_view text);

/// "A1": "joint_a1".
std::string ros_joint_name(const std::string& name);
/// "joint_a1": "A1"; other names as they are, but for characters that no column of a CSV may be named with.
std::string robot_joint_name(const std::string& name);

}  // namespace cellcal::calib
