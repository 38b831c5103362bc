#pragma once
// The few SVG elements that the figures are made of. Coordinates in pixels, y downwards.

#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace cellcal::sim::paper {

struct Point {
  double x, y;
};

enum class Anchor { kStart, kMiddle, kEnd };

class Svg {
 public:
  Svg(double width, double height);

  void line(Point from, Point to, std::string_view colour, double width = 1.0);
  void polyline(const std::vector<Point>& points, std::string_view colour, double width);
  void polygon(const std::vector<Point>& points, std::string_view fill, double opacity);
  void circle(Point centre, double radius, std::string_view fill, std::string_view stroke = "none",
              double opacity = 1.0);
  void rectangle(Point corner, double width, double height, std::string_view fill);
  void text(Point at, std::string_view words, double size, Anchor anchor = Anchor::kStart,
            std::string_view colour = "#333", bool bold = false);
  void vertical_text(Point at, std::string_view words, double size);

  /// The whole element.
  std::string str() const;

 private:
  double width_, height_;
  std::string body_;
};

}  // namespace cellcal::sim::paper
