#include "calib/export/svg.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "calib/files/text.h"
#include "calib/model/enum_table.h"

namespace cellcal::svg {

namespace {

// Far outside any page; larger coordinates are not meaningful.
constexpr double kFarOff = 1e5;

bool drawable(double value) { return std::isfinite(value) && std::abs(value) < kFarOff; }
bool drawable(Point point) { return drawable(point.x) && drawable(point.y); }

std::string attributes(const Style& style) {
  if (const auto* classes = std::get_if<std::string_view>(&style))
    return fmt::format(" class=\"{}\"", *classes);
  const Paint& paint = std::get<Paint>(style);
  std::string out = fmt::format(" fill=\"{}\" stroke=\"{}\" stroke-width=\"{}\" opacity=\"{}\"",
                                paint.fill, paint.stroke, paint.stroke_width, paint.opacity);
  if (paint.font_size > 0.0)
    out += fmt::format(" font-size=\"{}\" font-weight=\"{}\"", paint.font_size,
                       paint.bold ? "bold" : "normal");
  return out;
}

constexpr std::string_view kReplacement = "\xEF\xBF\xBD";  // U+FFFD
constexpr std::string_view kEllipsis = "\xE2\x80\xA6";     // U+2026

bool belongs_in_a_document(char32_t value) {
  if (value == '\n' || value == '\t') return true;
  if (value < 0x20 || (value >= 0x7F && value < 0xA0)) return false;
  // Bidirectional marks, embeddings, overrides and isolates; see Unicode TR 36.
  if (value == 0x061C || value == 0x200E || value == 0x200F) return false;
  if (value >= 0x202A && value <= 0x202E) return false;
  if (value >= 0x2066 && value <= 0x2069) return false;
  return value != 0xFFFE && value != 0xFFFF;
}

}  // namespace

Svg::Svg(double width, double height, std::string_view css_class, std::string_view description)
    : out_(fmt::format("<svg class=\"{}\" viewBox=\"0 0 {:.0f} {:.0f}\" role=\"img\" "
                       "aria-label=\"{}\">\n",
                       css_class, width, height, escape(description))) {}

Svg::Svg(double width, double height)
    : out_(fmt::format(
          "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0:.0f}\" height=\"{1:.0f}\" "
          "viewBox=\"0 0 {0:.0f} {1:.0f}\" font-family=\"sans-serif\" "
          "stroke-linejoin=\"round\">\n",
          width, height)) {
  rectangle({}, width, height, Paint{.fill = "white"});
}

void Svg::line(Point from, Point to, const Style& style) {
  if (!drawable(from) || !drawable(to)) return;
  fmt::format_to(std::back_inserter(out_),
                 "<line{} x1=\"{:.1f}\" y1=\"{:.1f}\" x2=\"{:.1f}\" y2=\"{:.1f}\"/>\n",
                 attributes(style), from.x, from.y, to.x, to.y);
}

void Svg::rectangle(Point corner, double width, double height, const Style& style) {
  if (!drawable(corner) || !drawable({width, height}) || width < 0.0 || height < 0.0) return;
  fmt::format_to(std::back_inserter(out_),
                 "<rect{} x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\"/>\n",
                 attributes(style), corner.x, corner.y, width, height);
}

void Svg::path(const std::vector<Point>& points, const Style& style) {
  if (points.empty() ||
      !std::all_of(points.begin(), points.end(), [](Point p) { return drawable(p); }))
    return;
  fmt::format_to(std::back_inserter(out_), "<path{} d=\"", attributes(style));
  for (std::size_t i = 0; i < points.size(); ++i) {
    fmt::format_to(std::back_inserter(out_), "{}{:.1f} {:.1f}", i == 0 ? "M" : "L", points[i].x,
                   points[i].y);
  }
  out_ += "\"/>\n";
}

void Svg::text(Point at, Anchor anchor, const Style& style, std::string_view content) {
  if (!drawable(at)) return;
  fmt::format_to(std::back_inserter(out_),
                 "<text{} x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"{}\">{}</text>\n",
                 attributes(style), at.x, at.y, own_name(anchor), escape(content));
}

void Svg::vertical_text(Point at, const Style& style, std::string_view content) {
  if (!drawable(at)) return;
  fmt::format_to(std::back_inserter(out_),
                 "<text{0} x=\"{1:.1f}\" y=\"{2:.1f}\" text-anchor=\"middle\" "
                 "transform=\"rotate(-90 {1:.1f} {2:.1f})\">{3}</text>\n",
                 attributes(style), at.x, at.y, escape(content));
}

void Svg::circle(Point centre, double radius, const Style& style, std::string_view title) {
  if (!drawable(centre) || !drawable(radius) || radius < 0.0) return;
  fmt::format_to(std::back_inserter(out_), "<circle{} cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"{:.1f}\"",
                 attributes(style), centre.x, centre.y, radius);
  close_with_title("circle", title);
}

void Svg::diamond(Point centre, double radius, const Style& style, std::string_view title) {
  if (!drawable(centre) || !drawable(radius) || radius < 0.0) return;
  fmt::format_to(std::back_inserter(out_),
                 "<path{} d=\"M{:.1f} {:.1f}L{:.1f} {:.1f}L{:.1f} {:.1f}L{:.1f} "
                 "{:.1f}Z\"",
                 attributes(style), centre.x, centre.y - radius, centre.x + radius, centre.y,
                 centre.x, centre.y + radius, centre.x - radius, centre.y);
  close_with_title("path", title);
}

void Svg::cross(Point centre, double radius, const Style& style, std::string_view title) {
  if (!drawable(centre) || !drawable(radius) || radius < 0.0) return;
  fmt::format_to(std::back_inserter(out_),
                 "<path{} d=\"M{:.1f} {:.1f}L{:.1f} {:.1f}M{:.1f} {:.1f}L{:.1f} "
                 "{:.1f}\"",
                 attributes(style), centre.x - radius, centre.y - radius, centre.x + radius,
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

std::string escape(std::string_view text) {
  std::string out;
  out.reserve(text.size());
  for (std::size_t at = 0; at < text.size();) {
    const calib::CodePoint point = calib::code_point_at(text, at);
    if (!point.valid || !belongs_in_a_document(point.value)) {
      out += kReplacement;
    } else if (point.value == '&') {
      out += "&amp;";
    } else if (point.value == '<') {
      out += "&lt;";
    } else if (point.value == '>') {
      out += "&gt;";
    } else if (point.value == '"') {
      out += "&quot;";
    } else if (point.value == '\'') {
      out += "&#39;";
    } else {
      out += text.substr(at, point.length);
    }
    at += point.length;
  }
  return out;
}

std::string shorten(std::string_view text, std::size_t code_points) {
  std::size_t count = 0;
  std::size_t cut = 0;  // where the text ends if an ellipsis follows
  for (std::size_t at = 0; at < text.size(); at += calib::code_point_at(text, at).length) {
    if (count + 1 == code_points) cut = at;
    if (++count > code_points) return std::string(text.substr(0, cut)).append(kEllipsis);
  }
  return std::string(text);
}

}  // namespace cellcal::svg
