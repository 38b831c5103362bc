#include "calib/estimate/predict.h"

#include <fmt/format.h>

#include <cstdio>
#include <nlohmann/json.hpp>

#include "calib/files/files.h"
#include "calib/model/units.h"
#include "daemon/cli/offline/exit_status.h"
#include "daemon/cli/offline/offline.h"

namespace cellcal::daemon {

namespace {

struct Row {
  calib::FrameMmDeg frame;
  double u95_mm = 0.0;
};

/// No touch was made there, and no arm gets there; what is predicted is right all the same.
void warn_beyond_limits(const calib::JointRows& asked) {
  for (const std::string& row : asked.beyond_limits_words)
    fmt::print(stderr, "warning: {}; predicted nevertheless\n", row);
  if (asked.beyond_limits > asked.beyond_limits_words.size())
    fmt::print(stderr, "warning: {} more such rows\n",
               asked.beyond_limits - asked.beyond_limits_words.size());
}

std::vector<Row> rows_of(const PredictCommand& command, const calib::Calibration& calibration) {
  const calib::Predictor predictor(calibration);
  std::vector<Row> rows;
  const calib::JointRows asked = calib::load_joints(command.joints, calibration.cell.robot);
  warn_beyond_limits(asked);
  for (const auto& joints : asked.joint_rad) {
    if (command.nominal) {
      rows.push_back({calib::to_frame(predictor.nominal(joints)), 0.0});
    } else {
      const calib::Prediction at = predictor.calibrated(joints);
      rows.push_back({calib::to_frame(at.tcp), at.u95_m * calib::kMmPerM});
    }
  }
  return rows;
}

std::string csv(const std::vector<Row>& rows, bool nominal) {
  std::string text =
      nominal ? "x_mm,y_mm,z_mm,a_deg,b_deg,c_deg\n" : "x_mm,y_mm,z_mm,a_deg,b_deg,c_deg,u95_mm\n";
  for (const Row& row : rows) {
    const auto& xyz = row.frame.xyz_mm;
    const auto& abc = row.frame.abc_deg;
    text += fmt::format("{:.9f},{:.9f},{:.9f},{:.9f},{:.9f},{:.9f}", xyz[0], xyz[1], xyz[2], abc[0],
                        abc[1], abc[2]);
    text += nominal ? "\n" : fmt::format(",{:.9f}\n", row.u95_mm);
  }
  return text;
}

std::string json(const std::vector<Row>& rows, bool nominal) {
  nlohmann::json list = nlohmann::json::array();
  for (const Row& row : rows) {
    const auto& xyz = row.frame.xyz_mm;
    const auto& abc = row.frame.abc_deg;
    list.push_back({{"x_mm", xyz[0]},
                    {"y_mm", xyz[1]},
                    {"z_mm", xyz[2]},
                    {"a_deg", abc[0]},
                    {"b_deg", abc[1]},
                    {"c_deg", abc[2]}});
    if (!nominal) list.back()["u95_mm"] = row.u95_mm;
  }
  return list.dump(1) + "\n";
}

}  // namespace

int predict(const PredictCommand& command) {
  // The nominal arm is no result; it stands in a withheld file as in any other.
  const auto calibration =
      usable_calibration("predict", command.calibration, command.withheld || command.nominal);
  if (!calibration) return kNotPublishable;
  const std::vector<Row> rows = rows_of(command, *calibration);
  put(command.json ? json(rows, command.nominal) : csv(rows, command.nominal), command.output);
  return kSuccess;
}

}  // namespace cellcal::daemon
