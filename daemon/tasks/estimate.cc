#include "daemon/tasks/estimate.h"

#include "calib/files/calibration_json.h"
#include "calib/files/files.h"
#include "calib/files/shipped_robots.h"
#include "calib/identify/identify.h"
#include "calib/syntax/input_file.h"
#include "calib/verdict/change.h"

namespace cellcal::daemon {

calib::Calibration estimate(const calib::Cell& cell, const SessionInputs& inputs,
                            const std::vector<calib::Touch>& touches,
                            const std::optional<Compared>& compared) {
  calib::Calibration calibration =
      calib::identify(cell, touches, {.region_poses = calib::kStatedPoses}, calib::shipped_robots);
  if (compared) {
    calib::judge_change(calib::calibration_from_json(compared->calibration, compared->words),
                        compared->words, compared->accepted, touches, calibration);
  }
  const std::string csv = calib::format_touches(touches, cell.robot);
  calibration.inputs = {{"cell", inputs.cell_name, calib::sha256(inputs.cell_text)},
                        {"robot", inputs.robot_name, calib::sha256(inputs.robot_text)},
                        {"touches", "touches.csv", calib::sha256(csv)}};
  return calibration;
}

}  // namespace cellcal::daemon
