#include "calib/plan/reach/reasons.h"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

namespace cellcal::calib {

namespace {

constexpr int kTried = 40;

std::optional<Hit> what_is_hit(const Clearance& clearance, const Candidate& c) {
  for (const JointVector* q : {&c.standoff, &c.clear})
    if (auto hit = clearance.hit(*q, kTipMarginM)) return hit;
  return clearance.hit_search(c.clear, c.end, c.target, kTipMarginM);
}

}  // namespace

std::string direction_words(const Eigen::Vector3d& normal) {
  return fmt::format("({:.2f}, {:.2f}, {:.2f})", normal.x(), normal.y(), normal.z());
}

std::optional<std::string> hindrance(const Cell& cell, const ArmModel& arm,
                                     const Clearance& clearance, const PlanOptions& options,
                                     std::size_t target) {
  Cell alone = cell;  // indices stay; of the others no touches are looked for
  for (std::size_t t = 0; t < alone.targets.size(); ++t)
    if (t != target) alone.targets[t].kind = TargetKind::kPoint;
  struct Reason {
    Hit hit;
    Eigen::Vector3d from;
    int count = 1;
  };
  std::vector<Reason> reasons;  // hits of the same things are one
  for (const Candidate& c :
       find_candidates(alone, arm, Clearance::blind(), options, kTried, Kinds::kSpheresAndPlanes)) {
    const auto hit = what_is_hit(clearance, c);
    if (!hit) continue;
    const auto like = std::find_if(reasons.begin(), reasons.end(),
                                   [&](const Reason& one) { return one.hit.is_like(*hit); });
    if (like == reasons.end())
      reasons.push_back({*hit, c.normal});
    else
      ++like->count;
  }
  const auto most =
      std::max_element(reasons.begin(), reasons.end(),
                       [](const Reason& a, const Reason& b) { return a.count < b.count; });
  if (most == reasons.end()) return std::nullopt;
  return "from direction " + direction_words(most->from) + " " + words(most->hit);
}

bool clear_line(const Clearance& clearance, const Candidate& c) {
  return clearance.clear_search(c.clear, c.end, c.target, kTipMarginM);
}

}  // namespace cellcal::calib
