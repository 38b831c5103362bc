#pragma once
// A small writer of inline SVG. Colours and line widths are CSS classes (style.cc), so that one
// drawing serves light, dark and paper. An element with a coordinate that is not finite, or far
// off any page, is not written; callers count such values and say so in words.

#include <string>
#include <string_view>
#include <vector>

namespace cellcal::daemon::report {

struct Point {
  double x = 0.0, y = 0.0;
};

enum class Anchor { kStart, kMiddle, kEnd };

class Svg {
 public:
  /// `description` is read out by screen readers. Pixels at 1:1; CSS scales the whole.
  Svg(double width, double height, std::string_view css_class, std::string_view description);

  void line(Point from, Point to, std::string_view css_class);
  void rectangle(Point corner, double width, double height, std::string_view css_class);
  void path(const std::vector<Point>& points, std::string_view css_class);
  void text(Point at, Anchor anchor, std::string_view css_class, std::string_view content);

  // `title`, where given, shows when a pointer rests on the mark.
  void circle(Point centre, double radius, std::string_view css_class, std::string_view title = {});
  void diamond(Point centre, double radius, std::string_view css_class,
               std::string_view title = {});
  void cross(Point centre, double radius, std::string_view css_class, std::string_view title = {});

  std::string finish() &&;

 private:
  void close_with_title(std::string_view element, std::string_view title);

  std::string out_;
};

}  // namespace cellcal::daemon::report
