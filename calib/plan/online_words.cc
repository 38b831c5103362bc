// Why no further touch is chosen: the number first, then what to do.

#include <fmt/format.h>

#include "calib/model/units.h"
#include "calib/plan/online.h"

namespace cellcal::calib {

std::string why_ended(const Progress& progress, const Goal& goal) {
  if (!progress.ended) return {};
  const double u95_mm = progress.u95_m * kMmPerM, goal_mm = goal.u95_m * kMmPerM;
  switch (*progress.ended) {
    case Ended::kGoal:
      return fmt::format("goal reached: u95 {:.3f} mm, goal {:.3f} mm", u95_mm, goal_mm);
    case Ended::kMostTouches:
      return fmt::format("all {} touches made; u95 {:.3f} mm{}", progress.touches, u95_mm,
                         goal_mm > 0.0 ? fmt::format(", goal {:.3f} mm", goal_mm) : "");
    case Ended::kNoGain:
      return fmt::format(
          "ten more touches would reduce the error by less than {:.0f} %; u95 {:.3f} mm, goal "
          "{:.3f} mm. Certified lengths, more spheres or other postures help more",
          100.0 * goal.worth_it, u95_mm, goal_mm);
    case Ended::kNoEstimate:
      return "some targets cannot be touched often enough for a first estimate";
    case Ended::kAllReachable:
      return "every reachable touch was made";
  }
  return {};
}

}  // namespace cellcal::calib
