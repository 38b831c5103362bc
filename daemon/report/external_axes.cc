// External axes as found: linear unit, and positioner with places on it.

#include "calib/estimate/external_axes.h"

#include <fmt/format.h>

#include <string>
#include <vector>

#include "calib/model/units.h"
#include "calib/result/calibration.h"
#include "daemon/report/report.h"

namespace cellcal::daemon::report {

namespace {

constexpr int kDirectionDecimals = 6;  // a microradian
constexpr int kScaleDecimals = 4;
constexpr double kPerMille = 1e3;  // mm per m, mrad

std::string line_table(const calib::LinearUnitLine& line) {
  Table table({"say.report.positioner.col.axis", "say.report.positioner.col.direction_x", "y", "z",
               "say.report.positioner.col.direction", "say.report.linear_unit.col.scale", "U",
               "say.report.linear_unit.col.from", "say.report.linear_unit.col.to"});
  const auto direction = [&](int k) { return signed_fixed(line.direction[k], kDirectionDecimals); };
  const auto end = [&](std::size_t k) {
    return line.touched_m ? mm((*line.touched_m)[k], 0) : "&ndash;";
  };
  table.row({escape(line.axis), direction(0), direction(1), direction(2),
             fixed(line.direction_u95_rad * kPerMille, kMmDecimals),
             signed_fixed(line.scale * kPerMille, kScaleDecimals),
             fixed(line.scale_u95 * kPerMille, kScaleDecimals), end(0), end(1)});
  return table.html();
}

std::string motion_table(const calib::LinearUnitLine& line) {
  Table table({"say.report.linear_unit.col.at", "say.report.linear_unit.col.along", "U",
               "say.report.linear_unit.col.across", "U", "say.report.linear_unit.col.above", "U",
               "say.report.linear_unit.col.roll", "U", "say.report.linear_unit.col.pitch", "U",
               "say.report.linear_unit.col.yaw", "U"});
  for (const calib::LinearUnitLine::At& at : line.at) {
    std::vector<std::string> cells = {mm(at.position_m, 0)};
    for (std::size_t k = 0; k < at.motion.size(); ++k)
      cells.insert(cells.end(), {signed_fixed(at.motion[k] * kPerMille, kMmDecimals),
                                 fixed(at.u95[k] * kPerMille, kMmDecimals)});
    table.row(cells);
  }
  return table.html();
}

constexpr int kAngleDecimals = 1;

void add_row(const calib::PositionerLine& line, double give_rad, Table& table) {
  std::vector<std::string> cells = {escape(line.axis)};
  for (const double one : line.point_m) cells.push_back(mm(one));
  for (const double one : line.direction) cells.push_back(signed_fixed(one, kDirectionDecimals));
  const auto end = [&](std::size_t k) {
    return line.touched_rad ? fixed((*line.touched_rad)[k] * calib::kDegPerRad, kAngleDecimals)
                            : std::string("&ndash;");
  };
  cells.insert(cells.end(), {positive_mm(line.place_u95_m),
                             fixed(line.direction_u95_rad * kPerMille, kMmDecimals),
                             fixed(give_rad * kPerMille, kMmDecimals), end(0), end(1)});
  table.row(cells);
}

}  // namespace

std::string linear_unit_table(const View& view) {
  if (!view.result.linear_unit) return {};
  const calib::LinearUnitLine& line = *view.result.linear_unit;
  return fmt::format("<h3>{}</h3>\n", say("say.report.linear_unit")) + line_table(line) +
         motion_table(line) + paragraph("note", say("say.report.linear_unit.note"));
}

std::string positioner_table(const View& view) {
  if (view.result.positioner.empty()) return {};
  Table table({"say.report.positioner.col.axis", "x, mm", "y, mm", "z, mm",
               "say.report.positioner.col.direction_x", "y", "z", "say.report.positioner.col.place",
               "say.report.positioner.col.direction", "say.report.positioner.col.gives",
               "say.report.positioner.col.from", "say.report.positioner.col.to"});
  for (std::size_t j = 0; j < view.result.positioner.size(); ++j)
    add_row(view.result.positioner[j], calib::largest_give_rad(view.result, j), table);
  return fmt::format("<h3>{}</h3>\n", say("say.report.positioner")) + table.html() +
         paragraph("note", say("say.report.positioner.note"));
}

Eigen::Vector3d place_in_base(const View& view, const calib::TargetResult& target) {
  const calib::Target* stated = view.cell_target(target.id);
  if (stated == nullptr || stated->carried_by == 0) return target.centre_m;
  const std::vector<double> zero(static_cast<std::size_t>(stated->carried_by));
  return calib::carried_as_found(view.result, zero) * target.centre_m;
}

}  // namespace cellcal::daemon::report
