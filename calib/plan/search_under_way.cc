#include "calib/plan/search_under_way.h"

#include <algorithm>
#include <cmath>

namespace cellcal::calib {

namespace {

JointVector interpolated(const JointVector& from, const JointVector& to, double share) {
  JointVector q(from);
  for (std::size_t i = 0; i < q.size(); ++i) q[i] += share * (to[i] - from[i]);
  return q;
}

/// Point of the straight move from `from` to `to` nearest to `at`, as a share.
double nearest_share(const JointVector& from, const JointVector& to, const JointVector& at) {
  double along = 0.0, length = 0.0;
  for (std::size_t i = 0; i < at.size(); ++i) {
    along += (at[i] - from[i]) * (to[i] - from[i]);
    length += (to[i] - from[i]) * (to[i] - from[i]);
  }
  return length > 0.0 ? std::clamp(along / length, 0.0, 1.0) : 0.0;
}

bool is_on(const JointVector& from, const JointVector& to, const JointVector& at) {
  if (from.size() != at.size() || to.size() != at.size()) return false;
  const JointVector nearest = interpolated(from, to, nearest_share(from, to, at));
  for (std::size_t i = 0; i < at.size(); ++i)
    if (!(std::abs(at[i] - nearest[i]) <= kOnWayRad)) return false;
  return true;
}

/// True on the search, or on the return from any of its points to the clear point.
bool is_on_search(const SearchUnderWay& left, const JointVector& at) {
  const JointVector& standoff = left.way.back();
  if (is_on(standoff, left.end, at)) return true;
  constexpr int kPlaces = 32;
  for (int k = 0; k <= kPlaces; ++k)
    if (is_on(interpolated(standoff, left.end, static_cast<double>(k) / kPlaces), left.out.front(),
              at))
      return true;
  return false;
}

}  // namespace

std::optional<std::vector<JointVector>> way_out_of(const SearchUnderWay& left,
                                                   const JointVector& at) {
  const bool searches = !left.end.empty();
  if (left.way.empty() || searches == left.out.empty()) return std::nullopt;
  if (searches && left.end.size() == left.way.back().size() && is_on_search(left, at))
    return left.out;
  for (std::size_t k = left.way.size() - 1; k > 0; --k) {
    if (!is_on(left.way[k - 1], left.way[k], at)) continue;
    std::vector<JointVector> rest(left.way.begin() + static_cast<std::ptrdiff_t>(k),
                                  left.way.end());
    rest.insert(rest.end(), left.out.begin(), left.out.end());
    return rest;
  }
  return std::nullopt;
}

}  // namespace cellcal::calib
