#include "daemon/cli/read_back.h"

#include "calib/export/krl_text.h"
#include "calib/export/urdf.h"
#include "calib/files/calibration_json.h"
#include "calib/files/cell_file.h"
#include "calib/files/files.h"
#include "calib/files/priors_file.h"
#include "calib/files/toml.h"
#include "calib/model/error.h"
#include "daemon/cli/offline.h"

namespace cellcal::daemon {

Reader as_robot() {
  return [](const std::string& text, const std::string& name) {
    calib::read_robot(calib::TomlTable::parse(text, name));
  };
}

Reader as_cell(std::string robot_name, std::string robot_text) {
  return [=](const std::string& text, const std::string& name) {
    calib::parse_cell({name, text, robot_name, robot_text});
  };
}

Reader as_urdf(std::string tip) {
  return
      [=](const std::string& text, const std::string& name) { calib::read_urdf(text, name, tip); };
}

Reader as_touches(const calib::Cell& cell) {
  return [&cell](const std::string& text, const std::string& name) {
    calib::parse_touches(text, name, cell);
  };
}

Reader as_joints(const calib::Robot& robot) {
  return [&robot](const std::string& text, const std::string& name) {
    calib::parse_joints(text, name, robot);
  };
}

Reader as_calibration() {
  return [](const std::string& text, const std::string& name) {
    calib::calibration_from_json(text, name);
  };
}

Reader as_priors() {
  return [](const std::string& text, const std::string& name) { calib::parse_priors(text, name); };
}

Reader as_krl() {
  return [](const std::string& text, const std::string& name) {
    calib::krl::read_lines({name, text});
  };
}

void read_back(const std::string& text, const std::filesystem::path& output, const Reader& reader) {
  const std::string name = output.empty() ? "standard output" : output.string();
  try {
    reader(text, name);
  } catch (const calib::FileError& error) {
    throw calib::FileError(std::string(error.what()) +
                           " (cellcal could not read this file again: not written)");
  }
}

void put_as(const Reader& reader, const std::string& text, const std::filesystem::path& output) {
  read_back(text, output, reader);
  put(text, output);
}

}  // namespace cellcal::daemon
