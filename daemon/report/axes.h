#pragma once
// Placement of labels, scales and ticks of all drawings.

#include <cstddef>
#include <string>
#include <vector>

#include "calib/export/svg.h"

namespace cellcal::daemon::report {

// Placement of labels in a drawing without covering marks.

class Labels {
 public:
  /// Bounds of the panel.
  Labels(double left, double top, double right) : left_(left), top_(top), right_(right) {}

  void keep_free(svg::Point corner, double width, double height);
  /// Start of the base line for a text of `letters` next to a mark of this radius: the first of four
  /// positions that covers nothing, otherwise the first. The area is reserved afterwards.
  svg::Point beside(svg::Point centre, double radius, std::size_t letters);

 private:
  struct Box {
    double left, top, right, bottom;
    bool overlaps(const Box& other) const {
      return left < other.right && other.left < right && top < other.bottom && other.top < bottom;
    }
  };
  double left_, top_, right_;
  std::vector<Box> taken_;
};

// Mapping of values to pixels, and round axis ticks.

/// Linear map of [from, to] onto [at_from, at_to].
struct Scale {
  double from = 0.0, to = 1.0;
  double at_from = 0.0, at_to = 1.0;

  double operator()(double value) const;
  /// The same, with the value clamped to [from, to].
  double clamped(double value) const;
  bool holds(double value) const;
};

/// Multiples of 1, 2 or 5 times a power of ten inside [from, to], about `wanted` and at most twice that.
/// Empty where the range is empty or not finite.
std::vector<double> round_ticks(double from, double to, int wanted);

/// Tick labels with the fewest decimals that distinguish neighbours.
std::vector<std::string> tick_labels(const std::vector<double>& ticks);

/// Grid lines and labels of an upward axis, the labels `gap` pixels to its left.
void draw_value_axis(svg::Svg& svg, const Scale& across, const Scale& up, int wanted, double gap);
/// The smallest of 1, 1.5, 2, 3, 4, 5, 6, 8 times a power of ten that is not below `value`; `fallback` where
/// the value is not finite or not positive.
double round_up(double value, double fallback);

}  // namespace cellcal::daemon::report
