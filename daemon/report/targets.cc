// Positions, effective sizes and residuals of the targets, and the results of the certified lengths.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <string_view>
#include <vector>

#include "calib/export/svg.h"
#include "calib/model/units.h"
#include "calib/verdict/artefacts.h"
#include "daemon/report/report.h"

namespace cellcal::daemon::report {

namespace {

constexpr int kCoarseDecimals = 2;  // for a residual in sigma
constexpr double kSameM = 1e-9;     // rounding of a length in a file

struct PerTarget {
  int count = 0;
  double sum_mm = 0.0, squares_mm2 = 0.0;
};

// Over all touches except outliers: a displaced target has a non-zero mean.
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

/// Found radius without the stated one.
std::string radius_offset(const View& view, const calib::TargetResult& target) {
  const calib::Target* in_cell = view.cell_target(target.id);
  const bool plane = in_cell && in_cell->kind == calib::TargetKind::kPlane;
  if (!in_cell || (in_cell->kind != calib::TargetKind::kSphere && !plane) ||
      target.effective_radius_m <= 0.0)
    return kDash;
  return signed_mm(target.effective_radius_m - (plane ? 0.0 : 0.5 * in_cell->diameter_m) -
                   view.result.cell.tool.tip_radius_m);
}

void add_row(const View& view, const calib::TargetResult& target, Table& table) {
  const calib::Target* in_cell = view.cell_target(target.id);
  const PerTarget sums = residuals_of(view, target.id);
  const bool has_mean = sums.count > 0 && !view.is_point(target.id);
  table.row(
      {escape(target.id), in_cell ? kind_word(in_cell->kind) : kDash, mm(target.centre_m.x()),
       mm(target.centre_m.y()), mm(target.centre_m.z()), positive_mm(target.effective_radius_m),
       radius_offset(view, target), std::to_string(sums.count),
       has_mean ? signed_fixed(sums.sum_mm / sums.count, kMmDecimals) : kDash,
       sums.count > 0 ? fixed(std::sqrt(sums.squares_mm2 / sums.count), kMmDecimals) : kDash});
}

// Orientation of planes and trackers, for which the mean position is of little use.
std::string stands_note(const View& view) {
  constexpr int kNormalDecimals = 5, kDegreeDecimals = 4;
  std::string items;
  for (const calib::TargetResult& target : view.result.targets) {
    const calib::Target* in_cell = view.cell_target(target.id);
    if (!in_cell) continue;
    if (in_cell->kind == calib::TargetKind::kPlane)
      items += paragraph("note", say({"say.report.targets.plane",
                                      {{"name", escape(target.id)},
                                       {"x", signed_fixed(target.normal.x(), kNormalDecimals)},
                                       {"y", signed_fixed(target.normal.y(), kNormalDecimals)},
                                       {"z", signed_fixed(target.normal.z(), kNormalDecimals)},
                                       {"distance", mm(target.distance_m)}}}));
    if (in_cell->kind != calib::TargetKind::kTracker) continue;
    const calib::FrameMmDeg frame = calib::to_frame(target.frame);
    items += paragraph("note", say({"say.report.targets.tracker",
                                    {{"name", escape(target.id)},
                                     {"x", fixed(frame.xyz_mm[0], kMmDecimals)},
                                     {"y", fixed(frame.xyz_mm[1], kMmDecimals)},
                                     {"z", fixed(frame.xyz_mm[2], kMmDecimals)},
                                     {"a", signed_fixed(frame.abc_deg[0], kDegreeDecimals)},
                                     {"b", signed_fixed(frame.abc_deg[1], kDegreeDecimals)},
                                     {"c", signed_fixed(frame.abc_deg[2], kDegreeDecimals)}}}));
  }
  return items;
}

// Targets on a positioner, whose places are in the frame of its axis.
std::string carried_note(const View& view) {
  const auto& axes = view.result.cell.robot.positioner;
  std::string items;
  for (std::size_t j = 0; j < axes.size(); ++j) {
    calib::Phrase names;
    for (const calib::TargetResult& target : view.result.targets) {
      const calib::Target* in_cell = view.cell_target(target.id);
      if (in_cell != nullptr && in_cell->carried_by == static_cast<int>(j) + 1)
        names = joined("say.join.comma", names, escape(target.id));
    }
    if (!names.empty())
      items += paragraph("note", say({"say.report.targets.carried",
                                      {{"names", names}, {"axis", escape(axes[j].name)}}}));
  }
  return items;
}

std::string lengths_table(const View& view) {
  const auto& lengths = view.result.cell.lengths;
  if (lengths.empty()) {
    return paragraph("note", say("say.report.lengths.none"));
  }
  Table table({"say.report.lengths.col.between", "say.report.lengths.col.certified", "&sigma;",
               "say.report.lengths.col.measured", "&sigma;", "say.report.lengths.col.difference",
               "say.report.lengths.col.in_sigma"});
  for (const calib::CertifiedLength& length : lengths) {
    std::string by_others = kDash, sigma = kDash, difference = kDash, in_sigma = kDash;
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
    table.row(
        {say({length.is_check ? "say.report.lengths.between.check" : "say.report.lengths.between",
              {{"from", escape(length.from)}, {"to", escape(length.to)}}}),
         mm(length.length_m), mm(length.sigma_m), by_others, sigma, difference, in_sigma});
  }
  return fmt::format("<h3>{}</h3>\n", say("say.report.lengths")) + table.html() +
         paragraph("note", say("say.report.lengths.note"));
}

std::string span_head(int columns, const char* id) {
  return fmt::format("<th class=\"span\" colspan=\"{}\" scope=\"colgroup\">{}</th>", columns,
                     say(id));
}

using svg::Anchor, svg::Point, svg::Svg;

constexpr double kSide = 232.0;
constexpr double kMiddle = 0.5 * kSide;
constexpr double kRadius = 96.0;         // px, of the disc: nadir of the sphere
constexpr double kLeastDirection = 0.5;  // of a unit vector; shorter ones have no valid direction
constexpr std::size_t kLabelLength = 24;

// Lambert azimuthal equal-area about the zenith: r = sin(polar angle / 2), 1 at the nadir.
Point project(const Eigen::Vector3d& direction) {
  const Eigen::Vector3d unit = direction.normalized();
  const double polar = std::acos(std::clamp(unit.z(), -1.0, 1.0));
  const double flat = std::hypot(unit.x(), unit.y());
  const double r = kRadius * std::sin(0.5 * polar);
  if (flat == 0.0) return {kMiddle + (unit.z() > 0.0 ? 0.0 : r), kMiddle};
  return {kMiddle + r * unit.x() / flat, kMiddle - r * unit.y() / flat};
}

double ring(double polar_deg) { return kRadius * std::sin(0.5 * polar_deg * calib::kRadPerDeg); }

struct Tally {
  int fit = 0, check = 0, outliers = 0;
};

std::string caption(const Tally& tally) {
  std::string words = say({"say.report.directions.fitted", {{"n", tally.fit}}});
  if (tally.check > 0) words += say({"say.report.directions.check", {{"n", tally.check}}});
  if (tally.outliers > 0)
    words += counted(static_cast<std::size_t>(tally.outliers), "say.report.directions.outliers.");
  return words;
}

void draw_disc(Svg& svg) {
  const Point middle{kMiddle, kMiddle};
  svg.circle(middle, kRadius, "disc");
  svg.circle(middle, ring(45.0), "grid");
  svg.circle(middle, ring(135.0), "grid");
  svg.circle(middle, ring(90.0), "equator");
  svg.line({kMiddle - kRadius, kMiddle}, {kMiddle + kRadius, kMiddle}, "grid");
  svg.line({kMiddle, kMiddle - kRadius}, {kMiddle, kMiddle + kRadius}, "grid");
  svg.text({kMiddle + kRadius + 5.0, kMiddle + 4.0}, Anchor::kStart, "tick", "x");
  svg.text({kMiddle, kMiddle - kRadius - 6.0}, Anchor::kMiddle, "tick", "y");
}

// Empty where no touch of this target has a direction.
std::string disc(const View& view, const std::string& id) {
  Tally tally;
  Svg svg(kSide, kSide, "chart disc-map", say({"say.report.directions.picture", {{"target", id}}}));
  draw_disc(svg);
  for (const Mark& mark : view.marks) {
    if (mark.target != id || mark.direction.norm() < kLeastDirection) continue;
    ++(mark.kind == MarkKind::kFit     ? tally.fit
       : mark.kind == MarkKind::kCheck ? tally.check
                                       : tally.outliers);
    draw_mark(svg, view, mark, project(mark.direction), 3.0, 4.4, "after");
  }
  if (tally.fit + tally.check + tally.outliers == 0) return {};
  return fmt::format("<figure>{}<figcaption><strong>{}</strong><br>{}</figcaption></figure>\n",
                     std::move(svg).finish(), escape(shorten(id, kLabelLength)), caption(tally));
}

}  // namespace

std::string targets_table(const View& view) {
  if (view.result.targets.empty())
    return section("targets", "say.report.targets", paragraph("", say("say.report.targets.none")));
  Table table({"say.report.col.target",
               {"say.report.col.kind", "word"},
               "x",
               "y",
               "z",
               "say.report.targets.col.found",
               "say.report.targets.col.less_nominal",
               "say.report.col.touches",
               "say.report.col.mean",
               "rms"},
              "",
              "<th></th><th></th>" + span_head(3, "say.report.targets.col.centre") +
                  span_head(2, "say.report.targets.col.radius") +
                  span_head(3, "say.report.targets.col.residual"));
  for (const calib::TargetResult& target : view.result.targets) add_row(view, target, table);
  const std::string body = table.html() +
                           paragraph("note", say(view.any_point() ? "say.report.targets.note.points"
                                                                  : "say.report.targets.note")) +
                           stands_note(view) + carried_note(view) + lengths_table(view);
  return section("targets", "say.report.targets", body);
}

// Contact directions of each sphere: one Lambert equal-area disc per target, in top view. With equal areas,
// an empty part of the disc is an equally large untouched part of the sphere.

std::string sphere_maps(const View& view) {
  std::string discs;
  std::vector<std::string> without;
  for (const calib::TargetResult& target : view.result.targets) {
    // A point has no contact direction: that of its residual is the direction of the error. A plane is always
    // touched along its normal.
    if (!view.is_round(target.id)) continue;
    const std::string one = disc(view, target.id);
    if (one.empty()) without.push_back(target.id);
    discs += one;
  }
  std::string body;
  if (!discs.empty()) {
    body += fmt::format("<div class=\"discs\">\n{}</div>\n", discs);
    body += paragraph("note", say("say.report.directions.note"));
  }
  if (!without.empty()) {
    std::string names;
    for (const std::string& id : without) {
      names += (names.empty() ? "" : ", ") + escape(shorten(id, kLabelLength));
    }
    body += paragraph("note", say({"say.report.directions.without", {{"names", names}}}));
  }
  if (body.empty()) return {};
  return section("directions", "say.report.directions", body);
}

}  // namespace cellcal::daemon::report
