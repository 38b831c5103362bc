#include "daemon/tasks/recorded/inputs.h"

#include "calib/files/files.h"

namespace cellcal::daemon {

SessionInputs read_inputs(const std::filesystem::path& cell_file) {
  calib::CellText text = calib::read_cell_text(cell_file);
  calib::parse_cell(text);  // what would not be understood must not be begun with
  SessionInputs inputs;
  inputs.cell_name = std::move(text.cell_name);
  inputs.cell_text = std::move(text.cell_text);
  inputs.robot_name = std::move(text.robot_name);
  inputs.robot_text = std::move(text.robot_text);
  return inputs;
}

calib::Cell cell_of(const SessionInputs& inputs) {
  return calib::parse_cell(
      {inputs.cell_name, inputs.cell_text, inputs.robot_name, inputs.robot_text});
}

}  // namespace cellcal::daemon
