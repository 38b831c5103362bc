#include "daemon/tasks/estimate.h"

#include "calib/files/calibration_json.h"
#include "calib/files/files.h"
#include "calib/files/input_file.h"
#include "calib/files/robot_file.h"
#include "calib/identify/identify.h"
#include "calib/identify/update.h"
#include "calib/verdict/change.h"

namespace cellcal::daemon {

namespace {

std::vector<calib::InputFile> files_of(const calib::Cell& cell, const SessionInputs& inputs,
                                       const std::vector<calib::Touch>& touches) {
  const std::string csv = calib::format_touches(touches, cell.robot);
  return {{"cell", inputs.cell_name, calib::sha256(inputs.cell_text)},
          {"robot", inputs.robot_name, calib::sha256(inputs.robot_text)},
          {"touches", "touches.csv", calib::sha256(csv)}};
}

}  // namespace

calib::Calibration estimate(const calib::Cell& cell, const SessionInputs& inputs,
                            const std::vector<calib::Touch>& touches,
                            const std::optional<Compared>& compared) {
  calib::Calibration calibration =
      calib::identify(cell, touches, {.region_poses = calib::kStatedPoses}, calib::shipped_robots);
  if (compared) {
    calib::judge_change(calib::calibration_from_json(compared->calibration, compared->words),
                        compared->words, compared->accepted, touches, calibration);
  }
  calibration.inputs = files_of(cell, inputs, touches);
  return calibration;
}

calib::Calibration estimate_update(const SessionInputs& inputs,
                                   const std::vector<calib::Touch>& touches, const Compared& last,
                                   double months, const std::vector<std::string>& not_found) {
  calib::Calibration calibration =
      calib::update(calib::calibration_from_json(last.calibration, last.words), touches,
                    {last.words, months, not_found, calib::kStatedPoses});
  calibration.inputs = files_of(calibration.cell, inputs, touches);
  calibration.inputs.push_back({"last calibration", last.words, calib::sha256(last.calibration)});
  return calibration;
}

}  // namespace cellcal::daemon
