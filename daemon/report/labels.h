#pragma once
// Places for words in a drawing where they cover nothing that matters.

#include <string>
#include <vector>

#include "calib/svg/svg.h"

namespace cellcal::daemon::report {

class Labels {
 public:
  /// The panel that labels stay in.
  Labels(double left, double top, double right) : left_(left), top_(top), right_(right) {}

  void keep_free(svg::Point corner, double width, double height);
  /// Where text of `letters` beside a mark of this radius begins, on its base line: the first of
  /// four places beside it that covers nothing; else the first. It is kept free from then on.
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
