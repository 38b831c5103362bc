#include "calib/consistency/session_order.h"

#include <algorithm>
#include <map>
#include <numeric>
#include <utility>

#include "calib/model/iso_time.h"

namespace cellcal::calib {

std::vector<std::size_t> in_order(std::span<const Touch> touches) {
  std::vector<std::size_t> order(touches.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::vector<double> seconds;
  for (const Touch& touch : touches) {
    const auto time = seconds_of(touch.time);
    if (!time) return order;
    seconds.push_back(*time);
  }
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return seconds[a] < seconds[b]; });
  return order;
}

std::vector<std::size_t> share_of(std::span<const Touch> touches, std::size_t most) {
  const std::size_t every = (touches.size() + most - 1) / most;
  std::map<std::pair<std::string, TouchSet>, std::size_t> seen;
  std::vector<std::size_t> share;
  for (const std::size_t i : in_order(touches))
    if (seen[{touches[i].target, touches[i].set}]++ % every == 0) share.push_back(i);
  std::sort(share.begin(), share.end());
  return share;
}

std::string id_after_move(const Cell& cell, const std::string& id) {
  std::string later = id;
  do later += " later";
  while (std::any_of(cell.targets.begin(), cell.targets.end(),
                     [&](const Target& target) { return target.id == later; }));
  return later;
}

TwoPlaces as_two(const Cell& cell, const std::vector<Touch>& touches, const std::string& target,
                 std::size_t after_touch, const std::optional<Eigen::Vector3d>& centre_m,
                 double sigma_m) {
  TwoPlaces two{cell, touches, id_after_move(cell, target)};
  Target later = cell.targets[cell.target_index(target)];
  later.id = two.later;
  later.centre_sigma_m = 0.0;
  if (centre_m) {
    later.has_centre = true;
    later.centre_m = *centre_m;
    later.centre_sigma_m = sigma_m;
  }
  two.cell.targets.push_back(later);
  bool passed = false;
  for (const std::size_t i : in_order(touches)) {
    if (passed && two.touches[i].target == target) two.touches[i].target = later.id;
    passed = passed || i == after_touch;
  }
  return two;
}

}  // namespace cellcal::calib
