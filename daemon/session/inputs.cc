#include "daemon/session/inputs.h"

#include "calib/files/documents.h"
#include "calib/files/files.h"

namespace cellcal::daemon {

namespace {

/// A cell or robot file is a few kilobytes; more is some other file.
constexpr std::size_t kLongestFile = 4u << 20;

}  // namespace

SessionInputs read_inputs(const std::filesystem::path& cell_file) {
  const std::filesystem::path robot_file = calib::robot_file_of(cell_file);
  SessionInputs inputs;
  inputs.cell_name = cell_file.string();
  inputs.cell_text = calib::read_file(cell_file, kLongestFile);
  inputs.robot_name = robot_file.string();
  inputs.robot_text = calib::read_file(robot_file, kLongestFile);
  cell_of(inputs);  // what would not be understood must not be begun with
  return inputs;
}

calib::Cell cell_of(const SessionInputs& inputs) {
  calib::Robot robot =
      calib::read_robot(calib::TomlTable::parse(inputs.robot_text, inputs.robot_name));
  return calib::read_cell(calib::TomlTable::parse(inputs.cell_text, inputs.cell_name),
                          std::move(robot));
}

}  // namespace cellcal::daemon
