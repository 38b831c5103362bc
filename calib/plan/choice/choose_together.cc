#include "calib/plan/choice/choose_together.h"

#include <optional>

#include "calib/model/long_work.h"

namespace cellcal::calib {

namespace {

constexpr int kExchanges = 2;

/// The one worth most that is not in the design yet.
template <typename Worth>
std::optional<Eigen::Index> best(const Design& design, std::vector<bool>& refused,
                                 const std::function<bool(std::size_t)>& possible,
                                 const Worth& worth) {
  while (true) {
    poll_cancelled();
    std::optional<Eigen::Index> found;
    for (Eigen::Index c = 0; c < design.size(); ++c)
      if (!design.has(c) && !refused[static_cast<std::size_t>(c)] &&
          (!found || worth(c) > worth(*found)))
        found = c;
    if (!found || possible(static_cast<std::size_t>(*found))) return found;
    refused[static_cast<std::size_t>(*found)] = true;
  }
}

}  // namespace

std::vector<std::size_t> choose_together(Design design, int count,
                                         const std::function<bool(std::size_t)>& possible) {
  std::vector<bool> refused(static_cast<std::size_t>(design.size()), false);
  std::vector<std::size_t> picked;
  while (static_cast<int>(picked.size()) < count) {
    const auto next =
        best(design, refused, possible, [&](Eigen::Index c) { return design.gain(c); });
    if (!next) break;
    design.take(*next);
    picked.push_back(static_cast<std::size_t>(*next));
  }
  for (int round = 0; round < kExchanges; ++round)
    for (std::size_t& pick : picked) {
      const auto own = static_cast<Eigen::Index>(pick);
      const Eigen::VectorXd gains = design.gains_without(own);
      const auto other = best(design, refused, possible, [&](Eigen::Index c) { return gains[c]; });
      if (!other || gains[*other] <= gains[own]) continue;
      design.drop(own);
      design.take(*other);
      pick = static_cast<std::size_t>(*other);
    }
  return picked;
}

}  // namespace cellcal::calib
