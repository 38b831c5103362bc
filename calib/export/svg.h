#pragma once
// A small SVG writer, for inline elements and standalone documents. An element with a coordinate
// that is not finite, or far off any page, is not written; callers count such values and report
// them.

#include <cstddef>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace cellcal::svg {

/// In pixels, y downwards.
struct Point {
  double x = 0.0, y = 0.0;
};

enum class Anchor { kStart, kMiddle, kEnd };

/// Presentation attributes without a style sheet.
struct Paint {
  std::string_view fill = "none", stroke = "none";
  double stroke_width = 1.0, opacity = 1.0;
  double font_size = 0.0;  ///< of text
  bool bold = false;
};

/// Classes of a style sheet, so that one drawing serves light, dark and print; or explicit
/// attributes.
using Style = std::variant<std::string_view, Paint>;

class Svg {
 public:
  /// Inline in a page. `description` is for screen readers. Pixels at 1:1; CSS scales the whole.
  Svg(double width, double height, std::string_view css_class, std::string_view description);
  /// A standalone document with a white background.
  Svg(double width, double height);

  void line(Point from, Point to, const Style& style);
  void rectangle(Point corner, double width, double height, const Style& style);
  void path(const std::vector<Point>& points, const Style& style);
  void text(Point at, Anchor anchor, const Style& style, std::string_view content);
  /// Rotated to read upwards, centred.
  void vertical_text(Point at, const Style& style, std::string_view content);

  // `title`, if given, is a tooltip.
  void circle(Point centre, double radius, const Style& style, std::string_view title = {});
  void diamond(Point centre, double radius, const Style& style, std::string_view title = {});
  void cross(Point centre, double radius, const Style& style, std::string_view title = {});

  std::string finish() &&;

 private:
  void close_with_title(std::string_view element, std::string_view title);

  std::string out_;
};

// Escaping for XML and HTML: user text never becomes markup.

/// For text and quoted attributes. Escapes & < > " ', and replaces invalid characters by U+FFFD:
/// control characters, broken UTF-8, bidirectional overrides (which can make one id look like
/// another).
std::string escape(std::string_view text);

/// At most `code_points` characters; the last one is an ellipsis if the text was cut. Not escaped.
std::string shorten(std::string_view text, std::size_t code_points);

}  // namespace cellcal::svg
