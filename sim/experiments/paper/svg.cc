#include "sim/experiments/paper/svg.h"

#include <fmt/format.h>

namespace cellcal::sim::paper {

namespace {

std::string escaped(std::string_view words) {
  std::string out;
  for (char c : words) {
    switch (c) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      default:
        out += c;
    }
  }
  return out;
}

std::string_view name(Anchor anchor) {
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

std::string joined(const std::vector<Point>& points) {
  std::string out;
  for (const Point& point : points) out += fmt::format("{:.2f},{:.2f} ", point.x, point.y);
  return out;
}

}  // namespace

Svg::Svg(double width, double height) : width_(width), height_(height) {
  rectangle({0.0, 0.0}, width, height, "white");
}

void Svg::line(Point from, Point to, std::string_view colour, double width) {
  body_ += fmt::format(
      "<line x1='{:.2f}' y1='{:.2f}' x2='{:.2f}' y2='{:.2f}' stroke='{}' stroke-width='{}'/>\n",
      from.x, from.y, to.x, to.y, colour, width);
}

void Svg::polyline(const std::vector<Point>& points, std::string_view colour, double width) {
  body_ += fmt::format(
      "<polyline points='{}' fill='none' stroke='{}' stroke-width='{}' stroke-linejoin='round'/>\n",
      joined(points), colour, width);
}

void Svg::polygon(const std::vector<Point>& points, std::string_view fill, double opacity) {
  body_ += fmt::format("<polygon points='{}' fill='{}' fill-opacity='{}'/>\n", joined(points), fill,
                       opacity);
}

void Svg::circle(Point centre, double radius, std::string_view fill, std::string_view stroke,
                 double opacity) {
  body_ += fmt::format(
      "<circle cx='{:.2f}' cy='{:.2f}' r='{:.2f}' fill='{}' stroke='{}' opacity='{:.2f}'/>\n",
      centre.x, centre.y, radius, fill, stroke, opacity);
}

void Svg::rectangle(Point corner, double width, double height, std::string_view fill) {
  body_ += fmt::format("<rect x='{:.2f}' y='{:.2f}' width='{:.2f}' height='{:.2f}' fill='{}'/>\n",
                       corner.x, corner.y, width, height, fill);
}

void Svg::text(Point at, std::string_view words, double size, Anchor anchor,
               std::string_view colour, bool bold) {
  body_ += fmt::format(
      "<text x='{:.2f}' y='{:.2f}' font-size='{}' text-anchor='{}' fill='{}'{}>{}</text>\n", at.x,
      at.y, size, name(anchor), colour, bold ? " font-weight='bold'" : "", escaped(words));
}

void Svg::vertical_text(Point at, std::string_view words, double size) {
  body_ += fmt::format(
      "<text transform='translate({:.2f},{:.2f}) rotate(-90)' font-size='{}' text-anchor='middle' "
      "fill='#333'>{}</text>\n",
      at.x, at.y, size, escaped(words));
}

std::string Svg::str() const {
  return fmt::format(
      "<svg xmlns='http://www.w3.org/2000/svg' width='{0}' height='{1}' viewBox='0 0 {0} {1}' "
      "font-family='sans-serif'>\n{2}</svg>\n",
      width_, height_, body_);
}

}  // namespace cellcal::sim::paper
