#pragma once
// Files go through the reader of their kind before they are written: a file that its own program refuses is
// never left behind.

#include <filesystem>
#include <functional>
#include <string>

#include "calib/model/robot.h"

namespace cellcal::daemon {

/// Reads a text as one kind of file, of that name. Throws calib::FileError.
using Reader = std::function<void(const std::string& text, const std::string& name)>;

Reader as_robot();
Reader as_cell(std::string robot_name, std::string robot_text);
Reader as_urdf(std::string tip = {});
Reader as_touches(const calib::Cell& cell);   ///< keeps a reference
Reader as_joints(const calib::Robot& robot);  ///< keeps a reference
Reader as_calibration();
Reader as_priors();
Reader as_krl();

/// Throws calib::FileError for a text that its reader refuses: nothing is to be written then.
void read_back(const std::string& text, const std::filesystem::path& output, const Reader& reader);
/// As put() (offline.h), after read_back().
void put_as(const Reader& reader, const std::string& text, const std::filesystem::path& output);

}  // namespace cellcal::daemon
