#include "calib/plan/reach/reasons.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>

namespace cellcal::calib {

namespace {

constexpr int kTried = 40;

std::optional<std::string> what_is_hit(const Clearance& clearance, const Candidate& c) {
  for (const JointVector* q : {&c.standoff, &c.clear})
    if (auto words = clearance.hit(*q, kTipMarginM)) return words;
  return clearance.hit_search(c.clear, c.end, c.target, kTipMarginM);
}

/// Two hits of the same things are one reason, however near they come.
std::string without_distance(const std::string& words) {
  constexpr std::string_view kWithin = " comes within ", kOf = " mm of ";
  const std::size_t begin = words.find(kWithin), end = words.find(kOf);
  if (begin == std::string::npos || end == std::string::npos || end < begin) return words;
  return words.substr(0, begin) + words.substr(end);
}

}  // namespace

std::string direction_words(const Eigen::Vector3d& normal) {
  return fmt::format("({:.2f}, {:.2f}, {:.2f})", normal.x(), normal.y(), normal.z());
}

std::string hindrance(const Cell& cell, const ArmModel& arm, const Clearance& clearance,
                      const PlanOptions& options, std::size_t target) {
  Cell alone = cell;  // indices stay; of the others no touches are looked for
  for (std::size_t t = 0; t < alone.targets.size(); ++t)
    if (t != target) alone.targets[t].kind = TargetKind::kPoint;
  struct Reason {
    int count = 0;
    std::string words;
  };
  std::map<std::string, Reason> reasons;
  for (const Candidate& c :
       find_candidates(alone, arm, Clearance::blind(), options, kTried, Kinds::kSpheresAndPlanes)) {
    const auto words = what_is_hit(clearance, c);
    if (!words) continue;
    Reason& reason = reasons[without_distance(*words)];
    if (reason.count++ == 0)
      reason.words = "from direction " + direction_words(c.normal) + " " + *words;
  }
  const auto most = std::max_element(
      reasons.begin(), reasons.end(),
      [](const auto& a, const auto& b) { return a.second.count < b.second.count; });
  return most == reasons.end() ? "" : most->second.words;
}

bool clear_line(const Clearance& clearance, const Candidate& c) {
  return clearance.clear_search(c.clear, c.end, c.target, kTipMarginM);
}

}  // namespace cellcal::calib
