#pragma once
// Placement of labels in a drawing without covering marks.

#include <string>
#include <vector>

#include "calib/svg/svg.h"

namespace cellcal::daemon::report {

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

}  // namespace cellcal::daemon::report
