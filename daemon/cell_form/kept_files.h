#pragma once
// Files of the cells' folder that a request may name: robots and meshes that came over the network.

#include <filesystem>
#include <string_view>

namespace cellcal::daemon {

inline constexpr std::string_view kRobotEnding = ".robot.toml", kMeshEnding = ".mesh.stl";

/// True for a regular file NAME + `ending` directly in this folder.
bool is_kept(const std::filesystem::path& file, const std::filesystem::path& folder,
             std::string_view ending);

}  // namespace cellcal::daemon
