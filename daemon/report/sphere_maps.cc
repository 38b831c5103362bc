// Where each sphere was touched: one Lambert equal-area disc per target, seen from above. Equal
// areas, so that an empty part of the disc is an empty part of the sphere of the same size.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "calib/model/units.h"
#include "calib/svg/svg.h"
#include "daemon/report/drawing/text.h"
#include "daemon/report/sections.h"

namespace cellcal::daemon::report {
namespace {

using svg::Anchor, svg::Point, svg::Svg;

constexpr double kSide = 232.0;
constexpr double kMiddle = 0.5 * kSide;
constexpr double kRadius = 96.0;         // px, of the disc: straight below the sphere's centre
constexpr double kLeastDirection = 0.5;  // of a unit vector; shorter is no direction
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
  std::string words = fmt::format("{} fitted", tally.fit);
  if (tally.check > 0) words += fmt::format(", {} held out", tally.check);
  if (tally.outliers > 0) {
    words += fmt::format(", {} {}", tally.outliers, tally.outliers == 1 ? "outlier" : "outliers");
  }
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
  Svg svg(kSide, kSide, "chart disc-map", fmt::format("Touches on {} seen from above", id));
  draw_disc(svg);
  for (const Mark& mark : view.marks) {
    if (mark.target != id || mark.direction.norm() < kLeastDirection) continue;
    const Point at = project(mark.direction);
    const std::string classes = fmt::format("{} after", css_class(mark.kind));
    const std::string title = mark_title(mark);
    switch (mark.kind) {
      case MarkKind::kFit:
        ++tally.fit;
        svg.circle(at, 3.0, classes, title);
        break;
      case MarkKind::kCheck:
        ++tally.check;
        svg.diamond(at, 4.4, classes, title);
        break;
      case MarkKind::kOutlier:
        ++tally.outliers;
        svg.cross(at, 4.4, classes, title);
        break;
    }
  }
  if (tally.fit + tally.check + tally.outliers == 0) return {};
  return fmt::format("<figure>{}<figcaption><strong>{}</strong><br>{}</figcaption></figure>\n",
                     std::move(svg).finish(), escape(shorten(id, kLabelLength)), caption(tally));
}

}  // namespace

std::string sphere_maps(const View& view) {
  std::string discs;
  std::vector<std::string> without;
  for (const calib::TargetResult& target : view.result.targets) {
    // A point is touched from nowhere: what direction its residual has is that of the error. A
    // plane is always touched along its normal.
    if (!view.is_round(target.id)) continue;
    const std::string one = disc(view, target.id);
    if (one.empty()) without.push_back(target.id);
    discs += one;
  }
  std::string body;
  if (!discs.empty()) {
    body += fmt::format("<div class=\"discs\">\n{}</div>\n", discs);
    body +=
        "<p class=\"note\">Seen from above: the middle is the top of the sphere, the heavier "
        "ring its equator, the rim its bottom; equal areas of the disc are equal areas of the "
        "sphere. x and y are the robot&rsquo;s base. Touches from one side only determine a "
        "centre badly, and with it the scale of the arm.</p>\n";
  }
  if (!without.empty()) {
    std::string names;
    for (const std::string& id : without) {
      names += (names.empty() ? "" : ", ") + escape(shorten(id, kLabelLength));
    }
    body += fmt::format("<p class=\"note\">Without directions of touch: {}.</p>\n", names);
  }
  if (body.empty()) return {};
  return section("directions", "Where the targets were touched", body);
}

}  // namespace cellcal::daemon::report
