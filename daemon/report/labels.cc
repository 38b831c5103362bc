#include "daemon/report/labels.h"

#include <algorithm>
#include <array>

namespace cellcal::daemon::report {

namespace {

using svg::Point;

constexpr double kLetterWidth = 8.0;  // px
constexpr double kLetterHeight = 13.0;
constexpr double kBaseLine = 10.5;  // below the top of a letter
constexpr double kGap = 5.0;

}  // namespace

void Labels::keep_free(Point corner, double width, double height) {
  taken_.push_back({corner.x, corner.y, corner.x + width, corner.y + height});
}

Point Labels::beside(Point centre, double radius, std::size_t letters) {
  const double width = kLetterWidth * static_cast<double>(letters), gap = radius + kGap;
  const std::array<Point, 4> corners{{{centre.x + gap, centre.y - 0.5 * kLetterHeight},
                                      {centre.x - gap - width, centre.y - 0.5 * kLetterHeight},
                                      {centre.x - 0.5 * width, centre.y - gap - kLetterHeight},
                                      {centre.x - 0.5 * width, centre.y + gap}}};
  Point chosen = corners[0];
  for (const Point& corner : corners) {
    const Box box{corner.x, corner.y, corner.x + width, corner.y + kLetterHeight};
    const bool inside = box.left >= left_ && box.right <= right_ && box.top >= top_;
    if (inside && std::none_of(taken_.begin(), taken_.end(),
                               [&box](const Box& other) { return box.overlaps(other); })) {
      chosen = corner;
      break;
    }
  }
  keep_free(chosen, width, kLetterHeight);
  return {chosen.x, chosen.y + kBaseLine};
}

}  // namespace cellcal::daemon::report
