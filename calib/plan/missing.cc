#include "calib/plan/missing.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>
#include <utility>

#include "calib/estimate/budget.h"
#include "calib/estimate/region.h"
#include "calib/model/product.h"
#include "calib/model/units.h"

namespace cellcal::calib {

namespace {

/// Squares of the tips' coordinates, three rows per posture, added up for each posture.
Eigen::VectorXd of_postures(const Eigen::VectorXd& squares) {
  return squares.reshaped(3, squares.size() / 3).colwise().sum().transpose();
}

/// The angles of a joint with the largest part: the postures in bins of equal width, the fullest
/// bin, and its neighbours that have half of it at least.
std::pair<double, double> fullest_angles(const std::vector<JointVector>& postures,
                                         std::size_t joint, const Eigen::VectorXd& part) {
  constexpr int kBins = 12;
  const auto [least, most] =
      std::ranges::minmax(postures, {}, [joint](const JointVector& q) { return q[joint]; });
  const double from = least[joint], width = (most[joint] - from) / kBins;
  if (!(width > 0.0)) return {from, from};
  Eigen::VectorXd bins = Eigen::VectorXd::Zero(kBins);
  for (std::size_t k = 0; k < postures.size(); ++k)
    bins[std::min(kBins - 1, static_cast<int>((postures[k][joint] - from) / width))] +=
        part[static_cast<Eigen::Index>(k)];
  int low = 0;
  const double half = 0.5 * bins.maxCoeff(&low);
  int high = low;
  while (low > 0 && bins[low - 1] >= half) --low;
  while (high + 1 < kBins && bins[high + 1] >= half) ++high;
  return {from + low * width, from + (high + 1) * width};
}

}  // namespace

Missing largest_part(const ArmModel& arm, const Remainder& left) {
  const Eigen::Index moved = left.moves_m.cols();
  const Eigen::MatrixXd reach = product(left.moves_m, left.covariance_u.topRows(moved));
  std::map<UncertaintySource, Eigen::VectorXd> parts;
  std::map<int, Eigen::VectorXd> of_joint, of_carrier;
  const auto count = static_cast<Eigen::Index>(left.postures.size());
  const auto add = [count](auto& to, auto key, const Eigen::VectorXd& part) {
    to.try_emplace(key, Eigen::VectorXd::Zero(count)).first->second += part;
  };
  Eigen::VectorXd by_touches =
      of_postures(reach.leftCols(moved).cwiseProduct(left.moves_m).rowwise().sum());
  for (std::size_t i = 0; i < left.keys.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    const Eigen::VectorXd part = of_postures((reach.col(k) * left.prior_weight[k]).cwiseAbs2());
    const UncertaintySource source = source_of(left.keys[i]);
    by_touches -= part;
    add(parts, source, part);
    if (source == UncertaintySource::kTransmission) add(of_joint, left.keys[i].joint, part);
    if (left.keys[i].kind == ParameterKind::kPositioner)
      add(of_carrier, left.keys[i].carrier, part);
  }
  add(parts, UncertaintySource::kTouches, by_touches.cwiseMax(0.0));
  add(parts, UncertaintySource::kRipple, ripple_variance_m2(arm, left.postures, left.ripple_rad));
  const auto less = [](const auto& a, const auto& b) { return a.second.sum() < b.second.sum(); };
  const auto largest = std::ranges::max_element(parts, less);
  double whole = 0.0;
  for (const auto& [source, part] : parts) whole += part.sum();
  Missing missing{largest->first, whole > 0.0 ? largest->second.sum() / whole : 0.0};
  if (missing.source == UncertaintySource::kPlaces && !of_carrier.empty()) {
    const auto axis = std::ranges::max_element(of_carrier, less);
    if (2.0 * axis->second.sum() < largest->second.sum()) return missing;
    missing.share = axis->second.sum() / whole;
    missing.joint = arm.robot().positioner[static_cast<std::size_t>(axis->first)].name;
  }
  if (missing.source != UncertaintySource::kTransmission) return missing;
  const auto joint = std::ranges::max_element(of_joint, less);
  const auto index = static_cast<std::size_t>(joint->first);
  missing.share = joint->second.sum() / whole;
  missing.joint = arm.robot().joints[index].name;
  std::tie(missing.from_rad, missing.to_rad) = fullest_angles(left.postures, index, joint->second);
  return missing;
}

Phrase phrase_of(const Missing& missing) {
  const double percent = 100.0 * missing.share;
  if (missing.joint.empty())
    return {
        "say.plan.missing.source",
        {{"share", percent},
         {"source", Phrase(std::string("say.certificate.source.") + to_string(missing.source))}}};
  if (missing.source == UncertaintySource::kPlaces)
    return {"say.plan.missing.positioner", {{"share", percent}, {"axis", Phrase(missing.joint)}}};
  return {"say.plan.missing.joint",
          {{"share", percent},
           {"joint", Phrase(missing.joint)},
           {"from", missing.from_rad * kDegPerRad},
           {"to", missing.to_rad * kDegPerRad}}};
}

}  // namespace cellcal::calib
