// Command cellcal predict.

#include "calib/estimate/predict.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <boost/algorithm/string/replace.hpp>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <ranges>
#include <span>
#include <stdexcept>
#include <utility>

#include "calib/export/corrector.h"
#include "calib/export/tables.h"
#include "calib/files/files.h"
#include "calib/files/text.h"
#include "calib/model/error.h"
#include "calib/model/units.h"
#include "daemon/cli/commands.h"
#include "daemon/cli/new_cell.h"
#include "daemon/cli/offline.h"
#include "daemon/cli/on_positioner.h"
#include "daemon/krl/controller_view.h"

namespace cellcal::daemon {

namespace {

/// The frame of all rows.
struct AskedRows {
  calib::JointRows rows;
  int carriers = 0;
  std::vector<std::vector<double>> carrier_rad;  ///< of each row; empty: the base frame
};

struct PredictedRow {
  calib::FrameMmDeg frame;
  double u95_mm = 0.0;
  Eigen::Vector3d error_mm = Eigen::Vector3d::Zero();  ///< calibrated minus nominal tip
};

/// No touch was made there and the arm cannot reach it; the prediction itself is valid.
void warn_beyond_limits(const calib::JointRows& asked) {
  for (const std::string& row : asked.beyond_limits_words)
    fmt::print(stderr, "warning: {}; predicted nevertheless\n", row);
  if (asked.beyond_limits > asked.beyond_limits_words.size())
    fmt::print(stderr, "warning: {} more such rows\n",
               asked.beyond_limits - asked.beyond_limits_words.size());
}

/// MASS,X,Y,Z. Throws std::runtime_error for a load that no arm carries.
calib::FlangeLoad flange_load(const std::vector<std::string>& given) {
  constexpr double kMostKg = 5e3, kMostMm = 1e4;
  std::vector<double> values;
  for (const std::string& one : given)
    if (const auto value = calib::number(one); value && std::abs(*value) <= kMostMm)
      values.push_back(*value);
  if (values.size() != 4 || given.size() != 4 || values[0] < 0.0 || values[0] > kMostKg)
    throw std::runtime_error(
        "--load: MASS,X,Y,Z with 0 to 5000 kg and a centre within 10 m of the flange, or a load of "
        "the cell file by its id");
  return {values[0], Eigen::Vector3d(values[1], values[2], values[3]) / calib::kMmPerM};
}

/// The calibration with one of the cell's tools by its id, or with another TCP on all their masses.
calib::Calibration with_named_tool(const calib::Calibration& calibration,
                                   const std::string& given) try {
  if (given.empty() || given.find(',') == std::string::npos)
    return calib::with_tool(calibration, given);
  const std::vector<double> six = numbers(given, {3, 6});
  calib::FrameMmDeg frame;
  std::copy_n(six.begin(), 3, frame.xyz_mm.begin());
  if (six.size() == 6) std::copy_n(six.begin() + 3, 3, frame.abc_deg.begin());
  calib::Tool tool;
  tool.tcp = calib::to_isometry(frame);
  return calib::with_load(calib::with_tool(calibration, tool),
                          calib::load_of_tools(calibration.cell));
} catch (const std::exception& wrong) {
  throw std::runtime_error(fmt::format("--tool {}: {}", given, wrong.what()));
}

/// The calibration with a load by its id in the cell file, or by figures.
calib::Calibration with_load(const calib::Calibration& calibration,
                             const std::vector<std::string>& given) {
  if (given.empty()) return calibration;
  if (given.size() > 1) {
    const calib::FlangeLoad load = flange_load(given);
    if (const auto heavier = krl::heavier_than_touched(calibration, load.mass_kg)) warn(*heavier);
    return calib::with_load(calibration, load);
  }
  const auto& loads = calibration.cell.loads;
  if (std::ranges::find(loads, given[0], &calib::Load::id) == loads.end())
    throw std::runtime_error(fmt::format(
        "--load {}: the calibration's cell has no such [[load]]; it has: {}", given[0],
        loads.empty()
            ? "none"
            : fmt::format("{}", fmt::join(loads | std::views::transform(&calib::Load::id), ", "))));
  const calib::Calibration loaded = calib::with_load(calibration, given[0]);
  const auto& touched = calibration.touched_loads;
  if (!touched.empty() && std::ranges::find(touched, given[0]) == touched.end())
    warn(krl::heavier_than_touched(calibration, calib::load_of_tools(loaded.cell).mass_kg)
             .value_or(calib::Phrase("say.cli.load.untouched", {{"load", given[0]}})));
  return loaded;
}

constexpr const char* kOption = "--joints";

std::vector<std::string> names_of_row(const calib::Robot& robot) {
  std::vector<std::string> names;
  for (const calib::Joint& joint : robot.joints) names.push_back(joint.name);
  return names;
}

/// "--joints: A5: ..." of "--joints:2: A5: ...": the option has no lines.
std::string without_line(const std::string& words) {
  return boost::algorithm::replace_first_copy(words, fmt::format("{}:2:", kOption),
                                              fmt::format("{}:", kOption));
}

bool is_no_file(const std::filesystem::path& joints) {
  std::error_code error;  // also of values that are too long for a name
  return !std::filesystem::exists(joints, error) && error != std::errc::permission_denied;
}

/// One row by its values, "0,-90,90,0,30,0", in place of a file.
bool are_values(const std::filesystem::path& joints) {
  return is_no_file(joints) && joints.string().find(',') != std::string::npos &&
         joints.string().find_first_not_of("0123456789+-., ") == std::string::npos;
}

calib::JointRows row_of_values(const std::string& values, const calib::Robot& robot) try {
  std::vector<std::string> names = names_of_row(robot);
  const std::ptrdiff_t given = 1 + std::ranges::count(values, ',');
  if (given > std::ssize(names))
    for (const calib::PositionerAxis& axis : robot.positioner) names.push_back(axis.name);
  if (given != std::ssize(names))
    throw std::runtime_error(fmt::format("{}: {} {} given, {} needed: {}", kOption, given,
                                         robot.first_turning() > 0 ? "positions" : "angles",
                                         names.size(), fmt::join(names, ", ")));
  calib::JointRows row =
      calib::parse_joints(fmt::format("{}\n{}\n", fmt::join(names, ","), values), kOption, robot);
  for (std::string& words : row.beyond_limits_words) words = without_line(words);
  return row;
} catch (const calib::FileError& wrong) {
  throw std::runtime_error(without_line(wrong.what()));
}

calib::JointRows rows_of(const std::filesystem::path& joints, const calib::Robot& robot) {
  if (are_values(joints)) return row_of_values(joints.string(), robot);
  if (is_no_file(joints))
    throw calib::FileError(
        calib::shown(joints.string(), 80),
        fmt::format(": no such file. Give a CSV file, or one row by its values, with decimal "
                    "points and commas between: {}",
                    fmt::join(names_of_row(robot), ",")));
  calib::JointRows rows = calib::load_joints(joints, robot);
  report_reading(joints, robot);
  return rows;
}

AskedRows asked_rows(const PredictCommand& command, const calib::Robot& robot) {
  AskedRows asked{rows_of(command.joints, robot), carriers_of(robot, command.on), {}};
  warn_of_radians(command.joints, robot, asked.rows.joint_rad);
  warn_beyond_limits(asked.rows);
  asked.carrier_rad = carrier_angles(asked.rows.positioner_rad, asked.carriers,
                                     are_values(command.joints) ? kOption : command.joints, robot);
  return asked;
}

std::vector<PredictedRow> predicted_rows(const PredictCommand& command,
                                         const calib::Calibration& calibration,
                                         const AskedRows& asked) {
  const calib::Predictor predictor(
      with_load(with_named_tool(calibration, command.tool), command.load), asked.carriers);
  std::vector<PredictedRow> rows;
  for (std::size_t i = 0; i < asked.rows.joint_rad.size(); ++i) {
    const auto& joints = asked.rows.joint_rad[i];
    const std::span<const double> carriers =
        asked.carriers > 0 ? asked.carrier_rad[i] : std::span<const double>{};
    const Eigen::Isometry3d nominal = predictor.nominal(joints, carriers);
    if (command.nominal) {
      rows.push_back({calib::to_frame(nominal)});
      continue;
    }
    const std::span<const double> outer =
        asked.carriers > 0 ? std::span(asked.rows.positioner_rad[i]).subspan(carriers.size())
                           : std::span<const double>{};
    const calib::Prediction at = predictor.calibrated(joints, carriers, outer);
    rows.push_back({calib::to_frame(at.tcp), at.u95_m * calib::kMmPerM,
                    (at.tcp.translation() - nominal.translation()) * calib::kMmPerM});
  }
  return rows;
}

/// Names and values of a row, with the deviation from the nominal arm and positioner in the frame of an axis.
std::vector<std::pair<const char*, double>> columns(const PredictedRow& row, bool nominal,
                                                    bool on_axis) {
  const auto& xyz = row.frame.xyz_mm;
  const auto& abc = row.frame.abc_deg;
  const Eigen::Vector3d& d = row.error_mm;
  std::vector<std::pair<const char*, double>> all{{"x_mm", xyz[0]},  {"y_mm", xyz[1]},
                                                  {"z_mm", xyz[2]},  {"a_deg", abc[0]},
                                                  {"b_deg", abc[1]}, {"c_deg", abc[2]}};
  if (!nominal) all.emplace_back("u95_mm", row.u95_mm);
  if (!nominal && on_axis)
    all.insert(all.end(), {{"dx_mm", d.x()}, {"dy_mm", d.y()}, {"dz_mm", d.z()}});
  return all;
}

std::string predicted_csv(const std::vector<PredictedRow>& rows, bool nominal, bool on_axis) {
  std::string text;
  for (const auto& [name, value] : columns({}, nominal, on_axis))
    text += fmt::format("{}{}", text.empty() ? "" : ",", name);
  for (const PredictedRow& row : rows) {
    const char* before = "\n";
    for (const auto& [name, value] : columns(row, nominal, on_axis))
      text += fmt::format("{}{:.9f}", std::exchange(before, ","), value);
  }
  return text + "\n";
}

std::string predicted_json(const std::vector<PredictedRow>& rows, bool nominal, bool on_axis) {
  nlohmann::json list = nlohmann::json::array();
  for (const PredictedRow& row : rows) {
    nlohmann::json& one = list.emplace_back();
    for (const auto& [name, value] : columns(row, nominal, on_axis)) one[name] = value;
  }
  return list.dump(1) + "\n";
}

}  // namespace

int predict(const PredictCommand& command) {
  // The nominal arm is not a result; a withheld file contains it as well.
  const auto calibration =
      usable_calibration("predict", command.calibration, command.withheld || command.nominal);
  if (!calibration) return kNotPublishable;
  const AskedRows asked = asked_rows(command, calibration->cell.robot);
  const std::vector<PredictedRow> rows = predicted_rows(command, *calibration, asked);
  std::vector<Eigen::Vector3d> tcps_m;
  for (const PredictedRow& row : rows)
    tcps_m.push_back(Eigen::Vector3d::Map(row.frame.xyz_mm.data()) / calib::kMmPerM);
  if (!command.nominal) warn_outside_scope(*calibration, tcps_m, asked.carrier_rad);
  const bool on_axis = asked.carriers > 0;
  put(command.json ? predicted_json(rows, command.nominal, on_axis)
                   : predicted_csv(rows, command.nominal, on_axis),
      command.output);
  return kSuccess;
}

}  // namespace cellcal::daemon
