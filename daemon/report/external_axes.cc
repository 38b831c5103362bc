// External axes as found: linear unit, and positioner with places on it.

#include <fmt/format.h>

#include <string>
#include <vector>

#include "calib/estimate/external_axes.h"
#include "calib/model/units.h"
#include "calib/result/calibration.h"
#include "daemon/report/plan_picture.h"
#include "daemon/report/report.h"

namespace cellcal::daemon::report {

namespace {

constexpr int kDirectionDecimals = 6;  // a microradian
constexpr int kScaleDecimals = 4;
constexpr double kPerMille = 1e3;  // mm per m, mrad

std::string cells(std::initializer_list<std::string> texts) {
  std::string all;
  for (const std::string& text : texts) all += "<td>" + text + "</td>";
  return all;
}

std::string line_table(const calib::LinearUnitLine& line) {
  const auto direction = [&](int k) { return signed_fixed(line.direction[k], kDirectionDecimals); };
  return fmt::format(
      "<div class=\"scroll\"><table class=\"numbers\">\n{}<tbody>\n<tr><th scope=\"row\">{}</th>{}</tr>\n"
      "</tbody>\n</table></div>\n",
      table_head({{say("say.report.positioner.col.axis")},
                  {say("say.report.positioner.col.direction_x")},
                  {"y"},
                  {"z"},
                  {say("say.report.positioner.col.direction")},
                  {say("say.report.linear_unit.col.scale")},
                  {"U"},
                  {say("say.report.linear_unit.col.from")},
                  {say("say.report.linear_unit.col.to")}}),
      escape(line.axis),
      cells({direction(0), direction(1), direction(2),
             fixed(line.direction_u95_rad * kPerMille, kMmDecimals),
             signed_fixed(line.scale * kPerMille, kScaleDecimals),
             fixed(line.scale_u95 * kPerMille, kScaleDecimals),
             line.touched_m ? fixed((*line.touched_m)[0] * calib::kMmPerM, 0) : "&ndash;",
             line.touched_m ? fixed((*line.touched_m)[1] * calib::kMmPerM, 0) : "&ndash;"}));
}

std::string motion_table(const calib::LinearUnitLine& line) {
  std::string rows;
  for (const calib::LinearUnitLine::At& at : line.at) {
    std::string row;
    for (std::size_t k = 0; k < at.motion.size(); ++k)
      row += cells({signed_fixed(at.motion[k] * kPerMille, kMmDecimals),
                    fixed(at.u95[k] * kPerMille, kMmDecimals)});
    rows += fmt::format("<tr><th scope=\"row\">{}</th>{}</tr>\n",
                        fixed(at.position_m * calib::kMmPerM, 0), row);
  }
  return fmt::format(
      "<div class=\"scroll\"><table class=\"numbers\">\n{}<tbody>\n{}</tbody>\n</table></div>\n",
      table_head({{say("say.report.linear_unit.col.at")},
                  {say("say.report.linear_unit.col.along")},
                  {"U"},
                  {say("say.report.linear_unit.col.across")},
                  {"U"},
                  {say("say.report.linear_unit.col.above")},
                  {"U"},
                  {say("say.report.linear_unit.col.roll")},
                  {"U"},
                  {say("say.report.linear_unit.col.pitch")},
                  {"U"},
                  {say("say.report.linear_unit.col.yaw")},
                  {"U"}}),
      rows);
}

constexpr int kAngleDecimals = 1;

std::string axis_row(const calib::PositionerLine& line, double give_rad) {
  std::string cells;
  for (const double one : line.point_m) cells += "<td>" + mm(one) + "</td>";
  for (const double one : line.direction)
    cells += "<td>" + signed_fixed(one, kDirectionDecimals) + "</td>";
  const auto end = [&](std::size_t k) {
    return line.touched_rad ? fixed((*line.touched_rad)[k] * calib::kDegPerRad, kAngleDecimals)
                            : std::string("&ndash;");
  };
  return fmt::format(
      "<tr><th scope=\"row\">{}</th>{}<td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td></tr>\n",
      escape(line.axis), cells, positive_mm(line.place_u95_m),
      fixed(line.direction_u95_rad * kPerMille, kMmDecimals),
      fixed(give_rad * kPerMille, kMmDecimals), end(0), end(1));
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
  std::string rows;
  for (std::size_t j = 0; j < view.result.positioner.size(); ++j)
    rows += axis_row(view.result.positioner[j], calib::largest_give_rad(view.result, j));
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
                  {say("say.report.positioner.col.gives")},
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
