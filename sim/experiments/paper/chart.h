#pragma once
// A chart with one x and one y axis: curves over numbers, or markers.

#include <string>
#include <vector>

#include "calib/svg/svg.h"

namespace cellcal::sim::paper {

enum class Mark { kLine, kDot };

struct Series {
  std::string name;
  std::string colour;
  Mark mark = Mark::kLine;
  std::vector<svg::Point> points;
};

struct Chart {
  std::string title, x_label, y_label;
  bool logarithmic_y = false;
  std::vector<Series> series;
};

/// Throws std::invalid_argument for a chart without points, and for values that are not positive
/// on a logarithmic axis.
std::string draw(const Chart& chart);

}  // namespace cellcal::sim::paper
