#include "daemon/cli/on_positioner.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cstdio>
#include <ranges>
#include <stdexcept>

#include "calib/estimate/predict.h"
#include "calib/model/error.h"
#include "calib/model/units.h"
#include "daemon/cli/commands.h"

namespace cellcal::daemon {

namespace {

std::string axis_names(const calib::Robot& robot) {
  return fmt::format(
      "{}",
      fmt::join(robot.positioner | std::views::transform(&calib::PositionerAxis::name), ", "));
}

/// Angles of one axis that nothing which it carries was touched at.
void warn_of_axis(const calib::PositionerLine& line, std::size_t axis,
                  const std::vector<std::vector<double>>& carrier_rad) {
  constexpr double kSlackRad = 1e-6;  // of decimals in files
  const auto outside = [&](const std::vector<double>& row) {
    return row[axis] < (*line.touched_rad)[0] - kSlackRad ||
           row[axis] > (*line.touched_rad)[1] + kSlackRad;
  };
  if (!line.touched_rad) return;
  const auto count = std::ranges::count_if(carrier_rad, outside);
  if (count == 0) return;
  const auto first = std::ranges::find_if(carrier_rad, outside);
  warn({"say.cli.outside_touched",
        {{"n", count},
         {"all", carrier_rad.size()},
         {"row", first - carrier_rad.begin() + 1},
         {"axis", line.axis},
         {"deg", (*first)[axis] * calib::kDegPerRad},
         {"least", (*line.touched_rad)[0] * calib::kDegPerRad},
         {"most", (*line.touched_rad)[1] * calib::kDegPerRad}}});
}

}  // namespace

int carriers_of(const calib::Robot& robot, const std::string& axis) {
  if (axis.empty()) return 0;
  const auto found = std::ranges::find(robot.positioner, axis, &calib::PositionerAxis::name);
  if (found == robot.positioner.end())
    throw std::runtime_error(
        fmt::format("--on {}: the calibration's robot has no such axis of a positioner; it has: {}",
                    axis, robot.positioner.empty() ? "none" : axis_names(robot)));
  return static_cast<int>(found - robot.positioner.begin()) + 1;
}

std::vector<std::vector<double>> carrier_angles(std::vector<std::vector<double>> positioner_rad,
                                                int carriers, const std::filesystem::path& table,
                                                const calib::Robot& robot) {
  if (carriers == 0) return {};
  if (positioner_rad.empty())
    throw calib::FileError(
        table.string(),
        fmt::format(": no column {0} with the positioner's angles, which --on {1} needs; add {0}",
                    axis_names(robot),
                    robot.positioner[static_cast<std::size_t>(carriers) - 1].name));
  for (std::vector<double>& row : positioner_rad) row.resize(static_cast<std::size_t>(carriers));
  return positioner_rad;
}

void warn_outside_scope(const calib::Calibration& calibration,
                        const std::vector<Eigen::Vector3d>& tcps_m,
                        const std::vector<std::vector<double>>& carrier_rad) {
  const std::size_t carriers = carrier_rad.empty() ? 0 : carrier_rad.front().size();
  const calib::Scope scope(calibration);
  const auto outside = [&](const Eigen::Vector3d& tcp_m) {
    return !scope.holds_at(tcp_m, static_cast<int>(carriers));
  };
  if (const auto count = std::ranges::count_if(tcps_m, outside); count > 0)
    warn({calibration.region.empty() ? "say.cli.outside_scope.targets"
                                     : "say.cli.outside_scope.postures",
          {{"n", count},
           {"all", tcps_m.size()},
           {"row", std::ranges::find_if(tcps_m, outside) - tcps_m.begin() + 1}}});
  for (std::size_t j = 0; j < carriers; ++j)
    if (j < calibration.positioner.size()) warn_of_axis(calibration.positioner[j], j, carrier_rad);
}

}  // namespace cellcal::daemon
