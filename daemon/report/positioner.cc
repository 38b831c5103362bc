// Axes of a positioner as found, and places on it.

#include <fmt/format.h>

#include <string>
#include <vector>

#include "calib/estimate/positioner.h"
#include "calib/model/units.h"
#include "calib/result/calibration.h"
#include "daemon/report/plan_picture.h"
#include "daemon/report/report.h"

namespace cellcal::daemon::report {

namespace {

constexpr int kDirectionDecimals = 6;  // a microradian
constexpr int kAngleDecimals = 1;
constexpr double kMradPerRad = 1e3;

std::string axis_row(const calib::PositionerLine& line) {
  std::string cells;
  for (const double one : line.point_m) cells += "<td>" + mm(one) + "</td>";
  for (const double one : line.direction)
    cells += "<td>" + signed_fixed(one, kDirectionDecimals) + "</td>";
  const auto end = [&](std::size_t k) {
    return line.touched_rad ? fixed((*line.touched_rad)[k] * calib::kDegPerRad, kAngleDecimals)
                            : std::string("&ndash;");
  };
  return fmt::format(
      "<tr><th scope=\"row\">{}</th>{}<td>{}</td><td>{}</td><td>{}</td><td>{}</td></tr>\n",
      escape(line.axis), cells, positive_mm(line.place_u95_m),
      fixed(line.direction_u95_rad * kMradPerRad, kMmDecimals), end(0), end(1));
}

}  // namespace

std::string positioner_table(const View& view) {
  if (view.result.positioner.empty()) return {};
  std::string rows;
  for (const calib::PositionerLine& line : view.result.positioner) rows += axis_row(line);
  return fmt::format(
      "<h3>{}</h3>\n<div class=\"scroll\"><table class=\"numbers\">\n{}<tbody>\n{}</tbody>\n</table>"
      "</div>\n{}",
      say("say.report.positioner"),
      table_head({{say("say.report.positioner.col.axis")},
                  {"x, mm"},
                  {"y, mm"},
                  {"z, mm"},
                  {say("say.report.positioner.col.direction_x")},
                  {"y"},
                  {"z"},
                  {say("say.report.positioner.col.place")},
                  {say("say.report.positioner.col.direction")},
                  {say("say.report.positioner.col.from")},
                  {say("say.report.positioner.col.to")}}),
      rows, paragraph("note", say("say.report.positioner.note")));
}

Eigen::Vector3d place_in_base(const View& view, const calib::TargetResult& target) {
  const calib::Target* stated = view.cell_target(target.id);
  if (stated == nullptr || stated->carried_by == 0) return target.centre_m;
  const std::vector<double> zero(static_cast<std::size_t>(stated->carried_by));
  return calib::carried_as_found(view.result, zero) * target.centre_m;
}

}  // namespace cellcal::daemon::report
