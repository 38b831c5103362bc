#include "calib/export/svg.h"

#include <gtest/gtest.h>

#include <limits>
#include <utility>

namespace cellcal::svg {
namespace {

std::string drawn(void (*draw)(Svg&)) {
  Svg svg(100.0, 50.0, "chart", "a picture");
  draw(svg);
  return std::move(svg).finish();
}

TEST(Svg, LeavesOutWhatHasNoFinitePlace) {
  const std::string empty = drawn([](Svg&) {});
  const std::string picture = drawn([](Svg& svg) {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    const double infinity = std::numeric_limits<double>::infinity();
    svg.line({nan, 0.0}, {1.0, 1.0}, "a");
    svg.line({0.0, 0.0}, {1.0, infinity}, "a");
    svg.rectangle({0.0, 0.0}, nan, 1.0, "a");
    svg.rectangle({0.0, 0.0}, -1.0, 1.0, "a");
    svg.circle({0.0, 0.0}, infinity, "a");
    svg.circle({0.0, 0.0}, -1.0, "a");
    svg.diamond({nan, 0.0}, 1.0, "a");
    svg.cross({0.0, 1e300}, 1.0, "a");
    svg.path({{0.0, 0.0}, {nan, 1.0}}, "a");
    svg.path({}, "a");
    svg.text({nan, 0.0}, Anchor::kEnd, "a", "lost");
    svg.vertical_text({0.0, infinity}, Paint{}, "lost");
  });
  EXPECT_EQ(picture, empty);
}

TEST(Svg, EscapesEveryWordThatItIsGiven) {
  const std::string picture = drawn([](Svg& svg) {
    svg.text({1.0, 1.0}, Anchor::kStart, "a", "<b>");
    svg.vertical_text({1.0, 1.0}, "a", "<b>");
    svg.circle({1.0, 1.0}, 1.0, "a", "\"><script>");
  });
  EXPECT_EQ(picture.find("<b>"), std::string::npos);
  EXPECT_EQ(picture.find("<script>"), std::string::npos);
  EXPECT_NE(picture.find("&lt;b&gt;"), std::string::npos);
}

TEST(Svg, WritesCoordinatesToATenthOfAPixel) {
  const std::string picture = drawn([](Svg& svg) {
    svg.line({1.0 / 3.0, 2.0}, {3.0, 4.0}, "grid");
  });
  EXPECT_NE(picture.find("<line class=\"grid\" x1=\"0.3\" y1=\"2.0\" x2=\"3.0\" y2=\"4.0\"/>"),
            std::string::npos);
}

TEST(Svg, StandsAloneWhereItsElementsBringTheirPaint) {
  Svg svg(100.0, 50.0);
  svg.circle({1.0, 2.0}, 3.0, Paint{.fill = "red", .opacity = 0.3});
  svg.text({1.0, 2.0}, Anchor::kEnd, Paint{.fill = "#333", .font_size = 12.0, .bold = true}, "A1");
  EXPECT_EQ(std::move(svg).finish(),
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"100\" height=\"50\" "
            "viewBox=\"0 0 100 50\" font-family=\"sans-serif\" stroke-linejoin=\"round\">\n"
            "<rect fill=\"white\" stroke=\"none\" stroke-width=\"1\" opacity=\"1\" x=\"0.0\" "
            "y=\"0.0\" width=\"100.0\" height=\"50.0\"/>\n"
            "<circle fill=\"red\" stroke=\"none\" stroke-width=\"1\" opacity=\"0.3\" cx=\"1.0\" "
            "cy=\"2.0\" r=\"3.0\"/>\n"
            "<text fill=\"#333\" stroke=\"none\" stroke-width=\"1\" opacity=\"1\" "
            "font-size=\"12\" font-weight=\"bold\" x=\"1.0\" y=\"2.0\" "
            "text-anchor=\"end\">A1</text>\n"
            "</svg>\n");
}

}  // namespace
}  // namespace cellcal::svg
