#include "daemon/report/drawing/svg.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "daemon/report/drawing/text.h"

namespace cellcal::daemon::report {
namespace {

// Far beyond any page; such a coordinate would be hundreds of digits of nothing.
constexpr double kFarOff = 1e5;

bool drawable(double value) { return std::isfinite(value) && std::abs(value) < kFarOff; }
bool drawable(Point point) { return drawable(point.x) && drawable(point.y); }

std::string_view anchor_name(Anchor anchor) {
  switch (anchor) {
    case Anchor::kStart:
      return "start";
    case Anchor::kMiddle:
      return "middle";
    case Anchor::kEnd:
      return "end";
  }
  return "start";
}

}  // namespace

Svg::Svg(double width, double height, std::string_view css_class, std::string_view description)
    : out_(fmt::format("<svg class=\"{}\" viewBox=\"0 0 {:.0f} {:.0f}\" role=\"img\" "
                       "aria-label=\"{}\">\n",
                       css_class, width, height, escape(description))) {}

void Svg::line(Point from, Point to, std::string_view css_class) {
  if (!drawable(from) || !drawable(to)) return;
  fmt::format_to(std::back_inserter(out_),
                 "<line class=\"{}\" x1=\"{:.1f}\" y1=\"{:.1f}\" x2=\"{:.1f}\" y2=\"{:.1f}\"/>\n",
                 css_class, from.x, from.y, to.x, to.y);
}

void Svg::rectangle(Point corner, double width, double height, std::string_view css_class) {
  if (!drawable(corner) || !drawable({width, height}) || width < 0.0 || height < 0.0) return;
  fmt::format_to(
      std::back_inserter(out_),
      "<rect class=\"{}\" x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\"/>\n",
      css_class, corner.x, corner.y, width, height);
}

void Svg::path(const std::vector<Point>& points, std::string_view css_class) {
  if (points.empty() ||
      !std::all_of(points.begin(), points.end(), [](Point p) { return drawable(p); }))
    return;
  fmt::format_to(std::back_inserter(out_), "<path class=\"{}\" d=\"", css_class);
  for (std::size_t i = 0; i < points.size(); ++i) {
    fmt::format_to(std::back_inserter(out_), "{}{:.1f} {:.1f}", i == 0 ? "M" : "L", points[i].x,
                   points[i].y);
  }
  out_ += "\"/>\n";
}

void Svg::text(Point at, Anchor anchor, std::string_view css_class, std::string_view content) {
  if (!drawable(at)) return;
  fmt::format_to(std::back_inserter(out_),
                 "<text class=\"{}\" x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"{}\">{}</text>\n",
                 css_class, at.x, at.y, anchor_name(anchor), escape(content));
}

void Svg::circle(Point centre, double radius, std::string_view css_class, std::string_view title) {
  if (!drawable(centre) || !drawable(radius) || radius < 0.0) return;
  fmt::format_to(std::back_inserter(out_),
                 "<circle class=\"{}\" cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"{:.1f}\"", css_class,
                 centre.x, centre.y, radius);
  close_with_title("circle", title);
}

void Svg::diamond(Point centre, double radius, std::string_view css_class, std::string_view title) {
  if (!drawable(centre) || !drawable(radius) || radius < 0.0) return;
  fmt::format_to(std::back_inserter(out_),
                 "<path class=\"{}\" d=\"M{:.1f} {:.1f}L{:.1f} {:.1f}L{:.1f} {:.1f}L{:.1f} "
                 "{:.1f}Z\"",
                 css_class, centre.x, centre.y - radius, centre.x + radius, centre.y, centre.x,
                 centre.y + radius, centre.x - radius, centre.y);
  close_with_title("path", title);
}

void Svg::cross(Point centre, double radius, std::string_view css_class, std::string_view title) {
  if (!drawable(centre) || !drawable(radius) || radius < 0.0) return;
  fmt::format_to(std::back_inserter(out_),
                 "<path class=\"{}\" d=\"M{:.1f} {:.1f}L{:.1f} {:.1f}M{:.1f} {:.1f}L{:.1f} "
                 "{:.1f}\"",
                 css_class, centre.x - radius, centre.y - radius, centre.x + radius,
                 centre.y + radius, centre.x - radius, centre.y + radius, centre.x + radius,
                 centre.y - radius);
  close_with_title("path", title);
}

std::string Svg::finish() && {
  out_ += "</svg>\n";
  return std::move(out_);
}

void Svg::close_with_title(std::string_view element, std::string_view title) {
  if (title.empty()) {
    out_ += "/>\n";
    return;
  }
  fmt::format_to(std::back_inserter(out_), "><title>{}</title></{}>\n", escape(title), element);
}

}  // namespace cellcal::daemon::report
