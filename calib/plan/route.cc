#include "calib/plan/route.h"

#include "calib/model/inverse.h"

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
  // Ways out of the neighbourhood of one sphere and into that of the next, the shortest first.
  std::vector<std::vector<JointVector>> out = {{}}, in = {{to.standoff}};
  for (const double height : kHeightsM) {
    if (leaving != nullptr)
      if (const auto over = above(*leaving, height, from)) out.push_back({*over});
    if (const auto over = above(to, height, to.standoff)) {
      in.push_back({*over, to.standoff});
      in.push_back({*over, to.clear, to.standoff});
    }
  }
  const auto joined = [](std::vector<JointVector> a, const std::vector<JointVector>& b) {
    a.insert(a.end(), b.begin(), b.end());
    return a;
  };
  for (const auto& first : out)
    for (const auto& last : in)
      if (auto chain = joined(first, last); clear_chain(from, chain)) return chain;
  // Over the resting posture: long, but known to be clear.
  const bool leaving_known = leaving != nullptr && !leaving->to_rest.empty();
  if (!to.from_rest.empty() && (leaving_known || clearance_.clear(from, rest_, kTipMarginM)))
    return joined(leaving_known ? leaving->to_rest : std::vector<JointVector>{rest_}, to.from_rest);
  return std::nullopt;
}

bool Router::connect(Candidate& candidate) const {
  auto in = to_standoff(rest_, nullptr, candidate);
  if (!in) return false;
  auto out = away(candidate, rest_);
  if (!out) return false;
  candidate.from_rest = std::move(*in);
  candidate.to_rest = std::move(*out);
  return true;
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
