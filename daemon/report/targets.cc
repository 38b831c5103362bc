// Where the targets are, how large they act, how well each one is met, and what became of the
// certified lengths.

#include <fmt/format.h>

#include <cmath>
#include <string>
#include <string_view>

#include "calib/model/units.h"
#include "calib/verdict/artefacts.h"
#include "daemon/report/drawing/text.h"
#include "daemon/report/sections.h"

namespace cellcal::daemon::report {
namespace {

constexpr std::string_view kNoValue = "\xE2\x80\x93";
constexpr int kCoarseDecimals = 2;  // of a residual in sigma
constexpr double kSameM = 1e-9;     // what a file's digits leave of a length

struct PerTarget {
  int count = 0;
  double sum_mm = 0.0, squares_mm2 = 0.0;
};

// Of all touches that are not outliers: a target that moved shows as a mean away from zero.
PerTarget residuals_of(const View& view, std::string_view id) {
  PerTarget sums;
  for (const Mark& mark : view.marks) {
    if (mark.target != id || mark.kind == MarkKind::kOutlier) continue;
    ++sums.count;
    sums.sum_mm += mark.after_mm;
    sums.squares_mm2 += mark.after_mm * mark.after_mm;
  }
  return sums;
}

std::string radius_cells(const View& view, const calib::TargetResult& target) {
  const calib::Target* in_cell = view.cell_target(target.id);
  const std::string effective =
      target.effective_radius_m > 0.0 ? mm(target.effective_radius_m) : std::string(kNoValue);
  const bool plane = in_cell && in_cell->kind == calib::TargetKind::kPlane;
  if (!in_cell || (in_cell->kind != calib::TargetKind::kSphere && !plane) ||
      target.effective_radius_m <= 0.0) {
    return fmt::format("<td>{}</td><td>{}</td>", effective, kNoValue);
  }
  return fmt::format(
      "<td>{}</td><td>{}</td>", effective,
      signed_mm(target.effective_radius_m - (plane ? 0.0 : 0.5 * in_cell->diameter_m) -
                view.result.cell.tool.tip_radius_m));
}

std::string target_row(const View& view, const calib::TargetResult& target) {
  const calib::Target* in_cell = view.cell_target(target.id);
  const PerTarget sums = residuals_of(view, target.id);
  const bool has_mean = sums.count > 0 && !view.is_point(target.id);
  const std::string mean =
      has_mean ? signed_fixed(sums.sum_mm / sums.count, kMmDecimals) : std::string(kNoValue);
  const std::string rms = sums.count > 0
                              ? fixed(std::sqrt(sums.squares_mm2 / sums.count), kMmDecimals)
                              : std::string(kNoValue);
  return fmt::format(
      "<tr><th scope=\"row\">{}</th><td class=\"word\">{}</td><td>{}</td><td>{}</td><td>{}</td>{}"
      "<td>{}</td><td>{}</td><td>{}</td></tr>\n",
      escape(target.id), in_cell ? kind_word(in_cell->kind) : kNoValue, mm(target.centre_m.x()),
      mm(target.centre_m.y()), mm(target.centre_m.z()), radius_cells(view, target), sums.count,
      mean, rms);
}

// How planes and trackers stand; the middle of what was touched says little of them.
std::string stands_note(const View& view) {
  constexpr int kNormalDecimals = 5, kDegreeDecimals = 4;
  std::string items;
  for (const calib::TargetResult& target : view.result.targets) {
    const calib::Target* in_cell = view.cell_target(target.id);
    if (!in_cell) continue;
    if (in_cell->kind == calib::TargetKind::kPlane)
      items += fmt::format(
          "<p class=\"note\">{}: plane, normal ({}, {}, {}), {}&nbsp;mm from the base&rsquo;s "
          "origin; x, y, z is the middle of what was touched.</p>\n",
          escape(target.id), signed_fixed(target.normal.x(), kNormalDecimals),
          signed_fixed(target.normal.y(), kNormalDecimals),
          signed_fixed(target.normal.z(), kNormalDecimals), mm(target.distance_m));
    if (in_cell->kind == calib::TargetKind::kTracker) {
      const calib::FrameMmDeg frame = calib::to_frame(target.frame);
      items += fmt::format(
          "<p class=\"note\">{}: tracker, its frame at ({}, {}, {})&nbsp;mm, A&nbsp;{}&deg;, "
          "B&nbsp;{}&deg;, C&nbsp;{}&deg; in base; x, y, z is the middle of what it "
          "measured.</p>\n",
          escape(target.id), fixed(frame.xyz_mm[0], kMmDecimals),
          fixed(frame.xyz_mm[1], kMmDecimals), fixed(frame.xyz_mm[2], kMmDecimals),
          signed_fixed(frame.abc_deg[0], kDegreeDecimals),
          signed_fixed(frame.abc_deg[1], kDegreeDecimals),
          signed_fixed(frame.abc_deg[2], kDegreeDecimals));
    }
  }
  return items;
}

std::string lengths_table(const View& view) {
  const auto& lengths = view.result.cell.lengths;
  if (lengths.empty()) {
    return "<p class=\"note\">No certified length between targets was given.</p>\n";
  }
  std::string rows;
  for (const calib::CertifiedLength& length : lengths) {
    std::string by_others(kNoValue), sigma(kNoValue), difference(kNoValue), in_sigma(kNoValue);
    for (const calib::LengthResult& found : view.result.lengths) {
      if (found.from != length.from || found.to != length.to ||
          std::abs(found.certified_m - length.length_m) > kSameM)
        continue;
      by_others = mm(found.by_others_m);
      sigma = mm(found.sigma_m);
      difference = signed_mm(found.by_others_m - found.certified_m);
      if (found.sigma_m > 0.0 || found.certified_sigma_m > 0.0)
        in_sigma = fixed(calib::contradiction(found), kCoarseDecimals);
    }
    rows += fmt::format(
        "<tr><th scope=\"row\">{} to {}</th><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td>"
        "<td>{}</td></tr>\n",
        escape(length.from), escape(length.to), mm(length.length_m), mm(length.sigma_m), by_others,
        sigma, difference, in_sigma);
  }
  return fmt::format(
      "<h3>Certified lengths, mm</h3>\n<div class=\"scroll\"><table "
      "class=\"numbers\">\n<thead><tr><th scope=\"col\">between</th><th "
      "scope=\"col\">certified</th><th scope=\"col\">&sigma;</th><th "
      "scope=\"col\">measured</th><th scope=\"col\">&sigma;</th><th "
      "scope=\"col\">difference</th><th scope=\"col\">in &sigma; of "
      "both</th></tr></thead>\n<tbody>\n{}</tbody>\n</table></div>\n<p "
      "class=\"note\">Measured: from the touches, the tolerances and the other lengths, "
      "without its own certificate. If they are more than 5&nbsp;&sigma; apart, one of them is "
      "wrong.</p>\n",
      rows);
}

}  // namespace

std::string targets_table(const View& view) {
  if (view.result.targets.empty()) {
    return section("targets", "Targets", "<p>The calibration has no targets.</p>\n");
  }
  std::string rows;
  for (const calib::TargetResult& target : view.result.targets) rows += target_row(view, target);
  std::string body = fmt::format(
      "<div class=\"scroll\"><table class=\"numbers\">\n<thead>\n<tr><th></th><th></th>"
      "<th class=\"span\" colspan=\"3\" scope=\"colgroup\">centre in base, mm</th>"
      "<th class=\"span\" colspan=\"2\" scope=\"colgroup\">effective radius, mm</th>"
      "<th class=\"span\" colspan=\"3\" scope=\"colgroup\">residual after, mm</th></tr>\n"
      "<tr><th scope=\"col\">target</th><th scope=\"col\" class=\"word\">kind</th>"
      "<th scope=\"col\">x</th><th scope=\"col\">y</th><th scope=\"col\">z</th>"
      "<th scope=\"col\">found</th><th scope=\"col\">&minus; nominal</th>"
      "<th scope=\"col\">touches</th><th scope=\"col\">mean</th><th scope=\"col\">rms</th></tr>\n"
      "</thead>\n<tbody>\n{}</tbody>\n</table></div>\n",
      rows);
  body += fmt::format(
      "<p class=\"note\">Effective radius: sphere plus tip plus trigger offset; nominal: "
      "sphere plus tip. Residuals are of fitted and held-out touches without outliers; a mean "
      "away from zero suggests that the target moved{}.</p>\n",
      view.any_point() ? "; residuals on points are distances and have none" : "");
  body += stands_note(view);
  body += lengths_table(view);
  return section("targets", "Targets", body);
}

}  // namespace cellcal::daemon::report
