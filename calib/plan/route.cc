#include "calib/plan/route.h"

#include "calib/plan/inverse.h"

namespace cellcal::calib {

namespace {

constexpr double kHeightsM[] = {0.06, 0.12, 0.25};  // above the sphere's top

}  // namespace

std::optional<JointVector> Router::above(const Candidate& candidate, double height_m,
                                         const JointVector& seed) const {
  const Target& target = cell_.targets[candidate.target];
  Eigen::Vector3d up = -cell_.robot.gravity_m_s2.normalized();
  if (!up.allFinite()) up = Eigen::Vector3d::UnitZ();
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() = candidate.orientation;
  pose.translation() = target.centre_m + (target.diameter_m / 2.0 + height_m) * up;
  return inverse(arm_, pose, seed, margin_rad_);
}

bool Router::clear_chain(const JointVector& from, const std::vector<JointVector>& chain) const {
  const JointVector* last = &from;
  for (const JointVector& next : chain) {
    if (!clearance_.clear(*last, next, kTipMarginM)) return false;
    last = &next;
  }
  return true;
}

std::optional<std::vector<JointVector>> Router::to_standoff(const JointVector& from,
                                                            const Candidate* leaving,
                                                            const Candidate& to) const {
  std::vector<JointVector> chain = {to.standoff};
  if (clear_chain(from, chain)) return chain;
  for (const double height : kHeightsM) {
    const auto over_to = above(to, height, to.standoff);
    if (!over_to) continue;
    chain = {*over_to, to.standoff};
    if (clear_chain(from, chain)) return chain;
    // Out along the touch normal first, straight on from where the clear point already leads.
    chain = {*over_to, to.clear, to.standoff};
    if (clear_chain(from, chain)) return chain;
    if (leaving == nullptr) continue;
    const auto over_from = above(*leaving, height, from);
    if (!over_from) continue;
    chain = {*over_from, *over_to, to.clear, to.standoff};
    if (clear_chain(from, chain)) return chain;
  }
  return std::nullopt;
}

std::optional<std::vector<JointVector>> Router::away(const Candidate& leaving,
                                                     const JointVector& to) const {
  std::vector<JointVector> chain = {to};
  if (clear_chain(leaving.clear, chain)) return chain;
  for (const double height : kHeightsM) {
    const auto over = above(leaving, height, leaving.clear);
    if (!over) continue;
    chain = {*over, to};
    if (clear_chain(leaving.clear, chain)) return chain;
  }
  return std::nullopt;
}

}  // namespace cellcal::calib
