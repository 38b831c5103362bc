#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

#include "tests/experiments/paper/figures.h"

namespace cellcal::sim::paper {
namespace {

Chart chart_of(std::vector<svg::Point> points, bool logarithmic) {
  Chart chart;
  chart.title = "title <1>";
  chart.logarithmic_y = logarithmic;
  chart.series = {{"series", "red", Mark::kDot, std::move(points)}};
  return chart;
}

TEST(Chart, KeepsEveryPointInsideThePicture) {
  const std::string svg = draw(chart_of({{0, 1e-9}, {50, 4.0}}, true));
  EXPECT_EQ(svg.find("cx=\"-"), std::string::npos);
  EXPECT_EQ(svg.find("cy=\"-"), std::string::npos);
  EXPECT_NE(svg.find("title &lt;1&gt;"), std::string::npos);
}

TEST(Chart, DrawsASinglePointAndEqualValues) {
  EXPECT_EQ(draw(chart_of({{1, 2.0}}, false)).find("nan"), std::string::npos);
  EXPECT_EQ(draw(chart_of({{1, 1.0}, {2, 1.0}}, true)).find("nan"), std::string::npos);
}

TEST(Chart, RefusesNothingToDrawAndNonPositiveValuesOnALogarithmicAxis) {
  EXPECT_THROW(draw(chart_of({}, false)), std::invalid_argument);
  EXPECT_THROW(draw(chart_of({{1, 0.0}}, true)), std::invalid_argument);
  EXPECT_THROW(draw(chart_of({{1, std::nan("")}}, true)), std::invalid_argument);
  EXPECT_THROW(draw(chart_of({{1, std::nan("")}}, false)), std::invalid_argument);
}

}  // namespace
}  // namespace cellcal::sim::paper
