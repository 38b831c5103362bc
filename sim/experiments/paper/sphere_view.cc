#include "sim/experiments/paper/sphere_view.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "calib/svg/svg.h"

namespace cellcal::sim::paper {

namespace {

using Eigen::Vector3d;
using svg::Anchor, svg::Paint, svg::Point, svg::Svg;

constexpr double kPanel = 380.0, kViewTop = 62.0, kViewBottom = 8.0;
constexpr double kShare = 0.42;  // radius of the drawn sphere relative to the panel's width
constexpr int kArcPoints = 60;
constexpr double kAzimuth = 3.7, kElevation = 0.5;  // rad; the viewpoint, on the side of the arm
constexpr double kBehind = 0.3;                     // opacity of parts hidden by the sphere
constexpr Paint kBall{.fill = "#f3f4f6", .stroke = "#9aa0a6"}, kArc{.stroke = "#d5d8dc"};
constexpr Paint kHeading{.fill = "#111", .font_size = 15.0, .bold = true};
constexpr Paint kViewTitle{.fill = "#111", .font_size = 13.0, .bold = true};
constexpr Paint kCloudName{.fill = "#333", .font_size = 12.0};

/// Right and up on the page and towards the viewer, for a point in the base frame.
Vector3d seen(const Vector3d& p) {
  const double ca = std::cos(kAzimuth), sa = std::sin(kAzimuth);
  const double ce = std::cos(kElevation), se = std::sin(kElevation);
  const Vector3d right(-sa, ca, 0.0), eye(ca * ce, sa * ce, se);
  return {right.dot(p), eye.cross(right).dot(p), eye.dot(p)};
}

struct Panel {
  double x0, scale;
  Point at(const Vector3d& view) const {
    return {x0 + kPanel / 2.0 + scale * view.x(), kViewTop + kPanel / 2.0 - scale * view.y()};
  }
};

void draw_grid(Svg& svg, const Panel& panel, double radius) {
  svg.circle(panel.at(Vector3d::Zero()), panel.scale * radius, kBall);
  const auto arc = [&](auto point_of) {
    std::vector<Point> piece;
    for (int i = 0; i <= kArcPoints; ++i) {
      const Vector3d view = seen(radius * point_of(2.0 * std::numbers::pi * i / kArcPoints));
      if (view.z() >= 0.0) {
        piece.push_back(panel.at(view));
      } else if (!piece.empty()) {
        svg.path(piece, kArc);
        piece.clear();
      }
    }
    if (piece.size() > 1) svg.path(piece, kArc);
  };
  for (int i = 0; i < 6; ++i) {
    const double longitude = std::numbers::pi * i / 6.0;
    arc([&](double t) {
      return Vector3d(std::cos(t) * std::cos(longitude), std::cos(t) * std::sin(longitude),
                      std::sin(t));
    });
  }
  for (int i = -2; i <= 2; ++i) {
    const double latitude = std::numbers::pi * i / 6.0;
    arc([&](double t) {
      return Vector3d(std::cos(latitude) * std::cos(t), std::cos(latitude) * std::sin(t),
                      std::sin(latitude));
    });
  }
}

bool hidden(const Vector3d& view, double radius) {
  return view.z() < 0.0 && view.head<2>().norm() < radius;
}

void draw_panel(Svg& svg, const SphereView& view, const Panel& panel) {
  struct Dot {
    Vector3d view;
    std::string colour;
  };
  std::vector<Dot> dots;
  for (const Cloud& cloud : view.clouds)
    for (const Vector3d& point : cloud.points_m) dots.push_back({seen(point), cloud.colour});
  std::sort(dots.begin(), dots.end(),
            [](const Dot& a, const Dot& b) { return a.view.z() < b.view.z(); });
  draw_grid(svg, panel, view.radius_m);
  for (const Dot& dot : dots)
    svg.circle(panel.at(dot.view), 3.6,
               Paint{.fill = dot.colour,
                     .stroke = "white",
                     .opacity = hidden(dot.view, view.radius_m) ? kBehind : 1.0});
  svg.text({panel.x0 + kPanel / 2.0, 66.0}, Anchor::kMiddle, kViewTitle, view.title);
}

}  // namespace

std::string draw(const std::string& heading, const std::vector<SphereView>& views) {
  Svg svg(kPanel * static_cast<double>(views.size()), kViewTop + kPanel + kViewBottom);
  svg.text({16.0, 24.0}, Anchor::kStart, kHeading, heading);
  double x = 16.0;
  if (!views.empty()) {
    for (const Cloud& cloud : views.front().clouds) {
      svg.circle({x + 5.0, 42.0}, 4.0, Paint{.fill = cloud.colour});
      svg.text({x + 15.0, 46.0}, Anchor::kStart, kCloudName, cloud.name);
      x += 15.0 + 6.6 * static_cast<double>(cloud.name.size()) + 18.0;
    }
  }
  for (std::size_t i = 0; i < views.size(); ++i)
    draw_panel(svg, views[i],
               {kPanel * static_cast<double>(i), kShare * kPanel / views[i].radius_m});
  return std::move(svg).finish();
}

}  // namespace cellcal::sim::paper
