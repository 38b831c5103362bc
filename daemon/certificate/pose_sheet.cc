#include "calib/check/pose_sheet.h"

#include <fmt/format.h>

#include "calib/model/units.h"
#include "daemon/certificate/certificate.h"
#include "daemon/report/say.h"

namespace cellcal::daemon::certificate {

namespace {

using Json = nlohmann::ordered_json;
using report::say;

constexpr int kSheetDecimals = 3;

std::string origin_of(const char* part, std::size_t row, const char* field) {
  return fmt::format("poses#{}/{}/{}", part, row, field);
}

PoseAccuracyRow row_of(const calib::PoseAccuracy& one, std::size_t row) {
  const auto from = [&](const char* field) { return origin_of("accuracy", row, field); };
  const auto mm = [&](double metres, const char* field) {
    return figure(metres * calib::kMmPerM, "mm", kSheetDecimals, from(field));
  };
  return {{one.target, from("target")},
          figure(one.poses, "", 0, from("poses")),
          mm(one.mean_m, "mean_mm"),
          mm(one.max_m, "max_mm"),
          mm(one.predicted_m, "predicted_mm")};
}

PoseRepeatabilityRow row_of(const calib::PoseRepeatability& one, std::size_t row) {
  const auto from = [&](const char* field) { return origin_of("repeatability", row, field); };
  const auto mm = [&](double metres, const char* field) {
    return figure(metres * calib::kMmPerM, "mm", kSheetDecimals, from(field));
  };
  return {{one.target, from("target")},
          figure(static_cast<double>(one.first + 1), "", 0, from("first")),
          figure(one.repeats, "", 0, from("repeats")),
          mm(one.mean_m, "mean_mm"),
          mm(one.sigma_m, "sigma_mm"),
          mm(one.rp_m, "rp_mm"),
          mm(one.predicted_m, "predicted_mm")};
}

std::string sheet_table(std::initializer_list<const char*> head, const std::string& rows) {
  std::string cells;
  for (const char* one : head)
    cells += fmt::format("<th{}>{}</th>", cells.empty() ? "" : " class=\"n\"", say(one));
  return fmt::format("<table>\n<thead><tr>{}</tr></thead>\n<tbody>\n{}</tbody></table>\n", cells,
                     rows);
}

std::string sheet_row(std::initializer_list<const Entry*> entries) {
  std::string cells;
  for (const Entry* one : entries)
    cells += fmt::format("<td{}>{}</td>", cells.empty() ? "" : " class=\"n\"", shown(*one));
  return "<tr>" + cells + "</tr>\n";
}

}  // namespace

PoseSheetData pose_sheet_of(const Sources& s, const std::vector<bool>& outlier) {
  const calib::PoseSheet sheet = calib::pose_sheet(s.calibration, s.touches, outlier);
  PoseSheetData data;
  for (const calib::PoseAccuracy& one : sheet.accuracy)
    data.accuracy.push_back(row_of(one, data.accuracy.size()));
  for (const calib::PoseRepeatability& one : sheet.repeatability)
    data.repeatability.push_back(row_of(one, data.repeatability.size()));
  return data;
}

std::string pose_sheet_html(const PoseSheetData& sheet) {
  if (sheet.empty()) return "";
  std::string html =
      "<h2>" + say({"say.certificate.poses", {{"standard", constant("performance")}}}) + "</h2>\n";
  std::string rows;
  for (const PoseAccuracyRow& one : sheet.accuracy)
    rows += sheet_row({&one.target, &one.poses, &one.mean, &one.largest, &one.predicted});
  if (!rows.empty())
    html +=
        sheet_table({"say.certificate.ap.of", "say.certificate.ap.poses", "say.certificate.ap.mean",
                     "say.certificate.ap.largest", "say.certificate.ap.predicted"},
                    rows);
  rows.clear();
  for (const PoseRepeatabilityRow& one : sheet.repeatability)
    rows += sheet_row(
        {&one.target, &one.first, &one.repeats, &one.mean, &one.sigma, &one.rp, &one.predicted});
  if (!rows.empty())
    html += sheet_table(
        {"say.certificate.rp.place", "say.certificate.rp.first", "say.certificate.rp.repeats",
         "say.certificate.rp.mean", "s, mm", "RP, mm", "say.certificate.rp.predicted"},
        rows);
  return html + report::paragraph(
                    "note",
                    say({sheet.repeatability.empty() ? "say.certificate.poses.note.no_rp"
                                                     : "say.certificate.poses.note",
                         {{"standard", constant("performance")}, {"cycles", constant("cycles")}}}));
}

Json pose_sheet_json(const PoseSheetData& sheet) {
  if (sheet.empty()) return nullptr;
  Json accuracy = Json::array(), repeatability = Json::array();
  for (const PoseAccuracyRow& one : sheet.accuracy)
    accuracy.push_back({{"target", one.target},
                        {"poses", one.poses},
                        {"ap_mean", one.mean},
                        {"ap_largest", one.largest},
                        {"predicted", one.predicted}});
  for (const PoseRepeatabilityRow& one : sheet.repeatability)
    repeatability.push_back({{"target", one.target},
                             {"first", one.first},
                             {"repeats", one.repeats},
                             {"mean", one.mean},
                             {"sigma", one.sigma},
                             {"rp", one.rp},
                             {"predicted", one.predicted}});
  return {{"terms", "ISO 9283"},
          {"is_a_test_by_it", false},
          {"accuracy", accuracy},
          {"repeatability", repeatability}};
}

}  // namespace cellcal::daemon::certificate
