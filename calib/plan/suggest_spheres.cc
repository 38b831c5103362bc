#include "calib/plan/suggest_spheres.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>
#include <string>
#include <utility>

#include "calib/model/long_work.h"
#include "calib/plan/cell_check.h"
#include "calib/plan/design.h"
#include "calib/plan/pool.h"

namespace cellcal::calib {

namespace {

using Eigen::Vector3d;

constexpr int kPostures = 600;
constexpr std::size_t kMostPlaces = 32;
constexpr double kApartM = 0.15;        ///< closer places carry the same information
constexpr double kGridM = 0.01;         ///< resolution of placing a stand
constexpr double kCentreSigmaM = 0.01;  ///< as for files without one
/// Above the floor, or the arm's foot if that is higher: higher stands sway.
constexpr double kHighestM = 1.0;
constexpr double kAroundBoxM = 0.2;  ///< margin around a box for places of spheres
constexpr std::size_t kSides = 12;   ///< touches by which a place is evaluated
/// Minimum variance of the touch directions along any axis; a twelfth for half a sphere.
constexpr double kLeastSpread = 0.05;
constexpr double kLengthSigmaM = 5e-6;
constexpr int kExchangeRounds = 4;
constexpr double kPaysShare = 1e-3;  ///< minimum relative gain of an exchange

struct Place {
  Vector3d centre_m;
  std::vector<Candidate> touches;
};

const Target& like(const Cell& cell) {
  const auto sphere =
      std::ranges::find(cell.targets, TargetKind::kSphere, [](const Target& t) { return t.kind; });
  if (sphere == cell.targets.end())
    throw PlanError(
        PlanError::Kind::kRequest,
        "the cell has no sphere to suggest places for. Add one with its diameter to the cell file");
  return *sphere;
}

Target sphere_at(const Target& like, const Vector3d& centre_m, std::string id) {
  Target target = like;
  target.id = std::move(id);
  target.has_centre = true;
  target.has_box = false;
  target.centre_m = centre_m;
  target.centre_sigma_m = kCentreSigmaM;
  return target;
}

/// Ids of the current spheres, followed by unused ones of S1, S2, ...
std::vector<std::string> ids_of(const Cell& cell, std::size_t count) {
  std::vector<std::string> ids;
  for (const Target& target : cell.targets)
    if (target.kind == TargetKind::kSphere && ids.size() < count) ids.push_back(target.id);
  for (int number = 1; ids.size() < count; ++number) {
    const std::string id = fmt::format("S{}", number);
    if (std::ranges::find(ids, id) == ids.end() &&
        std::ranges::find(cell.targets, id, &Target::id) == cell.targets.end())
      ids.push_back(id);
  }
  return ids;
}

/// Spheres at these places before the cell's other targets, with certified lengths between all of them if the cell has
/// one.
Cell with_spheres(const Cell& cell, const std::vector<Vector3d>& centres_m) {
  Cell result = cell;
  result.targets.clear();
  result.lengths.clear();
  const std::vector<std::string> ids = ids_of(cell, centres_m.size());
  double sigma_m = 0.0;
  for (const CertifiedLength& one : cell.lengths) sigma_m = std::max(sigma_m, one.sigma_m);
  for (std::size_t k = 0; k < centres_m.size(); ++k) {
    result.targets.push_back(sphere_at(like(cell), centres_m[k], ids[k]));
    for (std::size_t j = 0; j < k && !cell.lengths.empty(); ++j)
      result.lengths.push_back({result.targets[j].id, result.targets[k].id,
                                (centres_m[j] - centres_m[k]).norm(),
                                sigma_m > 0.0 ? sigma_m : kLengthSigmaM});
  }
  std::ranges::copy_if(cell.targets, std::back_inserter(result.targets),
                       [](const Target& one) { return one.kind != TargetKind::kSphere; });
  return result;
}

bool from_many_sides(const std::vector<Candidate>& touches) {
  if (touches.size() < kSides) return false;
  Vector3d mean = Vector3d::Zero();
  Eigen::Matrix3d square = Eigen::Matrix3d::Zero();
  for (const Candidate& c : touches) {
    mean += c.normal / static_cast<double>(touches.size());
    square += c.normal * c.normal.transpose() / static_cast<double>(touches.size());
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(square - mean * mean.transpose(),
                                                              Eigen::EigenvaluesOnly);
  return solver.eigenvalues()[0] >= kLeastSpread;
}

/// True if only this sphere makes the cell faulty.
bool is_refused_for(const Cell& cell, const std::string& sphere) {
  return std::ranges::any_of(faults_of(cell), [&](const CellFault& fault) {
    return fault.refused && std::ranges::find(fault.ids, sphere) != fault.ids.end();
  });
}

/// Empty if it cannot be touched from many sides.
std::optional<Place> place_at(const Cell& cell, const ArmModel& arm, const PlanOptions& options,
                              const Vector3d& centre_m) {
  const Cell alone = with_spheres(cell, {centre_m});
  const Clearance clearance(alone, arm);
  // A sphere that obstructs the resting arm blocks all paths.
  if (!clearance.clear(resting_posture(cell.robot, clearance), kTipMarginM)) return std::nullopt;
  Place place{centre_m,
              find_candidates(alone, arm, clearance, options, 3 * static_cast<int>(kSides))};
  if (!from_many_sides(place.touches) || is_refused_for(alone, alone.targets.front().id))
    return std::nullopt;
  // Every n-th: the candidates are ordered by direction.
  std::vector<Candidate> some;
  for (std::size_t k = 0; k < kSides; ++k)
    some.push_back(place.touches[k * place.touches.size() / kSides]);
  place.touches = std::move(some);
  return place;
}

std::vector<Place> possible_places(const Cell& cell, const ArmModel& arm,
                                   const PlanOptions& options) {
  AccuracyRegion region = options.region;
  if (region.kind == AccuracyRegion::Kind::kBox) {
    region.low_m.array() -= kAroundBoxM;
    region.high_m.array() += kAroundBoxM;
  }
  const auto postures =
      accuracy_region_postures(region, arm, {}, {}, options.limit_margin_rad, kPostures);
  const Vector3d up = up_of(cell.robot);
  const double highest_m = std::max(cell.floor_m.value_or(0.0), 0.0) + kHighestM;
  std::vector<Place> places;
  for (const JointVector& posture : postures) {
    poll_cancelled();
    if (places.size() == kMostPlaces) break;
    const Vector3d tip = arm.nominal_tcp(posture).translation();
    const Vector3d centre_m = (tip / kGridM).array().round().matrix() * kGridM;
    if (centre_m.dot(up) > highest_m) continue;
    if (std::ranges::any_of(
            places, [&](const Place& one) { return (one.centre_m - centre_m).norm() < kApartM; }))
      continue;
    if (auto place = place_at(cell, arm, options, centre_m)) places.push_back(std::move(*place));
  }
  return places;
}

/// Choice of the set of places that reduces the uncertainty over the region most.
class PlaceChoice {
 public:
  PlaceChoice(const Cell& cell, const std::vector<Place>& places, const AccuracyRegion& region)
      : places_(places.size()), design_(design_of(cell, places, region)) {}

  std::vector<std::size_t> best(std::size_t count) const {
    std::vector<std::size_t> chosen;
    for (std::size_t n = 0; n < count; ++n) {
      chosen.push_back(places_);
      replace(chosen, n, -1.0);
    }
    for (int round = 0; round < kExchangeRounds; ++round) {
      bool changed = false;
      for (std::size_t n = 0; n < count; ++n)
        changed = replace(chosen, n, (1.0 + kPaysShare) * worth(chosen)) || changed;
      if (!changed) break;
    }
    return chosen;
  }

 private:
  static Design design_of(const Cell& cell, const std::vector<Place>& places,
                          const AccuracyRegion& region) {
    std::vector<Vector3d> centres_m;
    std::vector<Candidate> candidates;
    for (const Place& place : places) {
      for (Candidate c : place.touches) {
        c.target = centres_m.size();
        candidates.push_back(std::move(c));
      }
      centres_m.push_back(place.centre_m);
    }
    DesignProblem problem = design_problem(with_spheres(cell, centres_m), candidates, region);
    return {std::move(problem.rows), std::move(problem.covariance_u), problem.moves_m};
  }

  /// Variance reduction over the region by touches of these places [m^2].
  double worth(const std::vector<std::size_t>& places) const {
    Design design = design_;
    double sum = 0.0;
    for (const std::size_t place : places)
      for (std::size_t k = place * kSides; k < (place + 1) * kSides; ++k) {
        sum += design.gain(static_cast<Eigen::Index>(k));
        design.take(static_cast<Eigen::Index>(k));
      }
    return sum;
  }

  /// Replaces the n-th place by the best one if the set's value then exceeds `more_than`.
  bool replace(std::vector<std::size_t>& chosen, std::size_t n, double more_than) const {
    std::vector<std::size_t> trial = chosen;
    bool better = false;
    for (std::size_t place = 0; place < places_; ++place) {
      if (std::ranges::find(chosen, place) != chosen.end()) continue;
      trial[n] = place;
      if (const double value = worth(trial); value > more_than) {
        more_than = value;
        chosen[n] = place;
        better = true;
      }
    }
    return better;
  }

  std::size_t places_;
  Design design_;
};

}  // namespace

SuggestedSpheres suggest_spheres(const Cell& cell, const PlanOptions& options, int count) {
  require_any_turn(cell.robot);
  refuse_external_axes(cell.robot, "suggesting places of spheres",
                       "Place them by hand, and let 'cellcal plan' state the accuracy");
  if (options.region.kind != AccuracyRegion::Kind::kWorkspace &&
      options.region.kind != AccuracyRegion::Kind::kBox)
    throw PlanError(
        PlanError::Kind::kRequest,
        "places are suggested for a region that does not depend on them. Use workspace or "
        "box:X,Y,Z,X,Y,Z");
  refuse_faulty(with_spheres(cell, {}));
  const ArmModel arm = planning_arm(cell);
  std::vector<Place> places = possible_places(cell, arm, options);
  const auto wanted = static_cast<std::size_t>(std::max(count, 1));
  while (places.size() >= wanted) {
    poll_cancelled();
    const std::vector<std::size_t> chosen = PlaceChoice(cell, places, options.region).best(wanted);
    std::vector<Vector3d> centres_m;
    for (const std::size_t place : chosen) centres_m.push_back(places[place].centre_m);
    Cell suggested = with_spheres(cell, centres_m);
    try {
      Plan plan = make_plan(suggested, options);
      return {std::move(suggested), std::move(plan)};
    } catch (const PlanError& error) {
      // Excludes a place without a clear path with the other spheres present.
      if (error.kind == PlanError::Kind::kRequest) throw;
      poll_cancelled();
      const auto blamed = std::ranges::find(suggested.targets, error.target, &Target::id);
      const auto worst = blamed == suggested.targets.end() ? 0 : blamed - suggested.targets.begin();
      places.erase(places.begin() +
                   static_cast<std::ptrdiff_t>(chosen[static_cast<std::size_t>(worst)]));
    }
  }
  throw PlanError(
      PlanError::Kind::kTooFew,
      fmt::format(
          "{} places can be touched from many sides, {} spheres need one each. Remove obstacles, or "
          "choose another region",
          places.size(), wanted));
}

}  // namespace cellcal::calib
