#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "calib/estimate/target.h"
#include "calib/identify/causes.h"
#include "calib/identify/mistakes.h"
#include "calib/model/kinematics.h"

namespace cellcal::calib {

namespace {

/// With more targets permutations are not tried; 5040 take milliseconds.
constexpr std::size_t kMostAssociated = 7;
/// Resolution of the nominal arm for permutations [m], mean over lengths and centres.
constexpr double kNominalCentreM = 1e-3;
/// Largest ratio of the deviation with permuted names to that with the stated ones.
constexpr double kNearer = 1.0 / 3.0;

bool touched(const std::vector<Touch>& touches, const std::string& target) {
  return std::any_of(touches.begin(), touches.end(),
                     [&](const Touch& t) { return t.target == target && t.set == TouchSet::kFit; });
}

}  // namespace

Names::Names(const Cell& cell) : of(cell.targets.size()) {
  std::iota(of.begin(), of.end(), std::size_t{0});
}

std::size_t Names::changed() const {
  std::size_t count = 0;
  for (std::size_t t = 0; t < of.size(); ++t) count += of[t] == t ? 0 : 1;
  return count;
}

std::vector<Touch> Names::given_to(const Cell& cell, std::vector<Touch> touches) const {
  for (Touch& touch : touches) touch.target = cell.targets[of[cell.target_index(touch.target)]].id;
  return touches;
}

Finding Names::cause(const Cell& cell) const {
  Finding finding = likely(LikelyCause::kTargetNames);
  for (std::size_t t = 0; t < of.size(); ++t) {
    if (of[t] == t) continue;
    finding.parts.push_back({about_target(cell.targets[t]), {}});
    finding.parts.back().about.other_end = cell.targets[of[t]].id;
  }
  return finding;
}

std::optional<Names> better_names(const Cell& cell, const std::vector<Touch>& touches) {
  std::vector<std::size_t> which;
  for (std::size_t t = 0; t < cell.targets.size(); ++t)
    if (has_a_centre(cell.targets[t].kind) && touched(touches, cell.targets[t].id))
      which.push_back(t);
  if (which.size() < 3 || which.size() > kMostAssociated) return {};

  Cell unstated = cell;  // a stated centre would attract another target's touches
  for (Target& target : unstated.targets) target.has_centre = false;
  const auto seen = seen_places(unstated, ArmModel(cell), touches);
  if (!seen) return {};
  // names[k]: actual target of the touches of which[k].
  const auto off_m = [&](const std::vector<std::size_t>& names) {
    std::vector<const Eigen::Vector3d*> centre(cell.targets.size(), nullptr);
    for (std::size_t k = 0; k < which.size(); ++k) centre[names[k]] = &(*seen)[which[k]].centre_m;
    for (std::size_t k = 0; k < which.size(); ++k)
      if (cell.targets[names[k]].carried_by != cell.targets[which[k]].carried_by)
        return std::numeric_limits<double>::infinity();  // its places are in another frame
    double sum = 0.0;
    int count = 0;
    for (const CertifiedLength& length : cell.lengths) {
      const Eigen::Vector3d* from = centre[cell.target_index(length.from)];
      const Eigen::Vector3d* to = centre[cell.target_index(length.to)];
      if (length.is_check || from == nullptr || to == nullptr) continue;
      sum += std::abs((*from - *to).norm() - length.length_m);
      ++count;
    }
    for (const std::size_t t : which)
      if (cell.targets[t].has_centre) {
        sum += (*centre[t] - cell.targets[t].centre_m).norm();
        ++count;
      }
    return count == 0 ? 0.0 : sum / count;
  };
  const double as_named_m = off_m(which);
  std::vector<std::size_t> names = which;
  double least_m = as_named_m;
  while (std::next_permutation(names.begin(), names.end()))
    least_m = std::min(least_m, off_m(names));
  if (!(least_m < kNearer * as_named_m)) return {};
  std::vector<std::size_t> best;
  std::size_t fewest = which.size() + 1, alike = 0;
  do {
    if (off_m(names) > least_m + kNominalCentreM) continue;
    std::size_t changed = 0;
    for (std::size_t k = 0; k < which.size(); ++k) changed += names[k] == which[k] ? 0 : 1;
    if (changed == 0) return {};
    if (changed > fewest) continue;
    alike = changed == fewest ? alike + 1 : 1;
    fewest = changed;
    best = names;
  } while (std::next_permutation(names.begin(), names.end()));
  if (alike != 1) return {};
  Names result(cell);
  for (std::size_t k = 0; k < which.size(); ++k) result.of[which[k]] = best[k];
  return result;
}

std::optional<Finding> scattered_touches(const Cell& cell, const std::vector<Touch>& touches) {
  const ArmModel arm(cell);
  std::optional<Finding> finding;
  int others = 0;
  for (const Target& target : cell.targets) {
    const LieTogether lie = lie_together(cell, arm, target.id, touches);
    if (2 * lie.most > lie.of || lie.of == 0) continue;
    if (finding)
      ++others;
    else
      finding = likely(LikelyCause::kScatteredTouches, about_target(target),
                       {{"together", static_cast<double>(lie.most), ""},
                        {"touches", static_cast<double>(lie.of), ""}});
  }
  if (finding) finding->evidence.push_back({"others", static_cast<double>(others), ""});
  return finding;
}

}  // namespace cellcal::calib
