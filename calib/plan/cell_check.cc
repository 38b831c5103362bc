// Contradictions between the entries of a cell file, and their sentences: the number first, then the remedy.

#include "calib/plan/cell_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "calib/model/enum_table.h"
#include "calib/model/units.h"
#include "calib/plan/bodies.h"
#include "calib/plan/candidates.h"
#include "calib/plan/clearance.h"
#include "calib/plan/finder.h"
#include "calib/plan/online.h"
#include "calib/plan/pool.h"
#include "calib/plan/positioner_plan.h"
#include "calib/plan/surroundings.h"

namespace cellcal::calib {

namespace {

using Kind = CellFaultKind;

/// Deviations above this many sigmas are mistakes, not chance.
constexpr double kMistakeSigmas = 4.0;
/// 1 sigma of a centre without a stated one: measured with a tape.
constexpr double kTypicalCentreM = 0.010;
/// Smaller errors of a centre are not reported: searches still meet the sphere, and touches correct
/// it.
constexpr double kIgnoredCentreErrorM = 0.010;
constexpr double kOverlapM = 1e-3;
/// Smaller values were probably stated in metres, a diameter perhaps in inches.
constexpr double kShortestToolM = 0.005, kThinnestSphereM = 0.005, kSmallestMeshM = 0.010;
/// Beyond these a diameter may be a radius or a mistake; 40 to 60 mm are usual.
constexpr double kSmallestUsualM = 0.030, kLargestUsualM = 0.150;
constexpr double kFinestTouchM = 0.5e-6, kCoarsestTouchM = 2e-3;
/// Relative tolerance within which a power of ten, or the two radii, explain a deviation.
constexpr double kExplained = 0.05;
constexpr int kReachTried = 60;  // candidates tried; plans need far fewer

double sigma_of(const Target& target) {
  return target.centre_sigma_m > 0.0 ? target.centre_sigma_m : kTypicalCentreM;
}

/// A certified length and the distance of its stated centres.
struct Compared {
  const CertifiedLength* length;
  std::size_t from, to;
  double centres_m = 0.0, sigma_m = 0.0;

  double off_m() const { return std::abs(centres_m - length->length_m); }
  bool fits() const { return off_m() <= kMistakeSigmas * sigma_m; }  // (66)
};

std::vector<Compared> compare(const Cell& cell) {
  std::vector<Compared> all;
  for (const CertifiedLength& length : cell.lengths) {
    Compared one{&length, cell.target_index(length.from), cell.target_index(length.to)};
    const Target &a = cell.targets[one.from], &b = cell.targets[one.to];
    if (!a.has_centre || !b.has_centre) continue;
    one.centres_m = (a.centre_m - b.centre_m).norm();
    one.sigma_m = std::hypot(std::hypot(sigma_of(a), sigma_of(b)), length.sigma_m);
    all.push_back(one);
  }
  return all;
}

bool all_fit(const std::vector<Compared>& all) {
  return std::all_of(all.begin(), all.end(), [](const Compared& one) { return one.fits(); });
}

/// Two targets whose exchanged centres make all lengths fit.
std::optional<std::pair<std::size_t, std::size_t>> exchanged(const Cell& cell) {
  Cell other = cell;
  for (std::size_t i = 0; i < cell.targets.size(); ++i)
    for (std::size_t k = i + 1; k < cell.targets.size(); ++k) {
      if (!cell.targets[i].has_centre || !cell.targets[k].has_centre) continue;
      std::swap(other.targets[i].centre_m, other.targets[k].centre_m);
      if (all_fit(compare(other))) return std::pair(i, k);
      std::swap(other.targets[i].centre_m, other.targets[k].centre_m);
    }
  return std::nullopt;
}

/// The one target common to all lengths that do not fit, if there are two or more. (A length
/// perpendicular to the error of its centre may still fit.)
std::optional<std::size_t> common_end(const std::vector<Compared>& all, std::size_t targets) {
  for (std::size_t t = 0; t < targets; ++t) {
    int here = 0;
    const bool explains = std::all_of(all.begin(), all.end(), [&](const Compared& one) {
      const bool ends_here = one.from == t || one.to == t;
      here += ends_here && !one.fits();
      return ends_here || one.fits();
    });
    if (explains && here >= 2) return t;
  }
  return std::nullopt;
}

CellFault length_fault(const Cell& cell, const Compared& one) {
  CellFault fault;
  fault.kind = Kind::kLength;
  fault.refused = one.off_m() > kIgnoredCentreErrorM;
  fault.ids = {one.length->from, one.length->to};
  fault.a_m = one.length->length_m;
  fault.b_m = one.centres_m;
  fault.sigma_m = one.sigma_m;
  const double radii = (cell.targets[one.from].diameter_m + cell.targets[one.to].diameter_m) / 2.0;
  if (radii > 0.0 && std::abs(one.off_m() - radii) < kExplained * radii)
    fault.kind = Kind::kSurfaces;
  for (const double factor : {10.0, 100.0, 1000.0, 0.1, 0.01, 0.001})
    if (std::abs(one.length->length_m / factor - one.centres_m) < kExplained * one.centres_m) {
      fault.kind = Kind::kDecimalPoint;
      fault.c_m = one.length->length_m / factor;
    }
  return fault;
}

void compare_lengths(const Cell& cell, std::vector<CellFault>& faults) {
  const std::vector<Compared> all = compare(cell);
  if (all_fit(all)) return;
  const auto wrong = std::count_if(all.begin(), all.end(), [](auto& one) { return !one.fits(); });
  if (wrong > 1) {
    if (const auto pair = exchanged(cell)) {
      faults.push_back({Kind::kCentresExchanged,
                        true,
                        {cell.targets[pair->first].id, cell.targets[pair->second].id}});
      return;
    }
    if (const auto target = common_end(all, cell.targets.size())) {
      CellFault fault{Kind::kCentre, false, {cell.targets[*target].id}};
      for (const Compared& one : all)
        if (!one.fits() && one.off_m() > fault.a_m) {
          fault.a_m = one.off_m();
          fault.sigma_m = one.sigma_m;
        }
      fault.refused = fault.a_m > kIgnoredCentreErrorM;
      faults.push_back(fault);
      return;
    }
  }
  for (const Compared& one : all)
    if (!one.fits()) faults.push_back(length_fault(cell, one));
}

bool joins(const CertifiedLength& one, const std::string& a, const std::string& b) {
  return (one.from == a && one.to == b) || (one.from == b && one.to == a);
}

void compare_lengths_of_one_pair(const Cell& cell, std::vector<CellFault>& faults) {
  for (auto one = cell.lengths.begin(); one != cell.lengths.end(); ++one)
    for (auto other = one + 1; other != cell.lengths.end(); ++other) {
      if (!joins(*one, other->from, other->to)) continue;
      const double sigma = std::hypot(one->sigma_m, other->sigma_m);
      if (one->length_m == other->length_m && one->sigma_m == other->sigma_m)
        faults.push_back({Kind::kLengthTwice, true, {one->from, one->to}, one->length_m});
      else if (std::abs(one->length_m - other->length_m) > kMistakeSigmas * sigma)
        faults.push_back({Kind::kTwoLengths,
                          true,
                          {one->from, one->to},
                          one->length_m,
                          other->length_m,
                          0.0,
                          sigma});
    }
}

/// Also applies without stated centres.
void compare_lengths_with_each_other(const Cell& cell, std::vector<CellFault>& faults) {
  const auto between = [&](const std::string& a, const std::string& b) -> const CertifiedLength* {
    for (const CertifiedLength& length : cell.lengths)
      if (joins(length, a, b)) return &length;
    return nullptr;
  };
  for (const CertifiedLength& length : cell.lengths) {
    const double radii = (cell.targets[cell.target_index(length.from)].diameter_m +
                          cell.targets[cell.target_index(length.to)].diameter_m) /
                         2.0;
    if (length.length_m < radii)
      faults.push_back(
          {Kind::kLengthTooShort, true, {length.from, length.to}, length.length_m, radii});
    for (const Target& third : cell.targets) {
      const CertifiedLength* one = between(length.from, third.id);
      const CertifiedLength* other = between(length.to, third.id);
      if (one == nullptr || other == nullptr) continue;
      const double both = one->length_m + other->length_m;
      const double sigma = std::hypot(std::hypot(one->sigma_m, other->sigma_m), length.sigma_m);
      if (length.length_m <= both + kMistakeSigmas * sigma) continue;
      faults.push_back(
          {Kind::kTriangle, true, {length.from, length.to, third.id}, length.length_m, both});
      return;  // one wrong length affects many triangles
    }
  }
}

void check_overlaps(const Cell& cell, std::vector<CellFault>& faults) {
  const auto is_there = [](const Target& target) {
    return target.kind == TargetKind::kSphere && target.has_centre;
  };
  for (std::size_t i = 0; i < cell.targets.size(); ++i)
    for (std::size_t k = i + 1; k < cell.targets.size(); ++k) {
      const Target &a = cell.targets[i], &b = cell.targets[k];
      if (!is_there(a) || !is_there(b)) continue;
      const double apart = (a.centre_m - b.centre_m).norm();
      const double radii = (a.diameter_m + b.diameter_m) / 2.0;
      if (apart > radii - kOverlapM) continue;
      const double sigma = std::hypot(sigma_of(a), sigma_of(b));
      const bool refused = apart < kOverlapM || apart + kMistakeSigmas * sigma < radii;
      faults.push_back({Kind::kOverlap, refused, {a.id, b.id}, apart, radii, 0.0, sigma});
    }
}

void check_containment(const Cell& cell, std::vector<CellFault>& faults) {
  Cell rest = cell;
  rest.targets.clear();
  const Surroundings things(rest);
  for (const Target& target : cell.targets) {
    if (target.kind != TargetKind::kSphere || !target.has_centre) continue;
    const double radius = target.diameter_m / 2.0;
    const Segment centre{target.centre_m, target.centre_m};
    for (std::size_t i = 0; i < things.size(); ++i) {
      const double deep = radius - std::max(0.0, things.distance_m(i, centre, radius));
      if (deep <= kOverlapM) continue;
      const double sigma = sigma_of(target);
      const bool refused = deep >= radius || deep > kMistakeSigmas * sigma;
      faults.push_back(
          {Kind::kInside, refused, {target.id, things.words(i)}, deep, 0.0, 0.0, sigma});
    }
  }
}

/// Reach within the joint limits, ignoring obstacles, which the plan checks.
void check_reach(const Cell& cell, std::vector<CellFault>& faults) {
  const ArmModel arm = planning_arm(cell);
  for (std::size_t t = 0; t < cell.targets.size(); ++t) {
    const Target& target = cell.targets[t];
    if (!is_planned(target, Kinds::kSpheresAndPlanes) || !target.has_centre) continue;
    const double from_base = target.centre_m.norm();
    if (from_base < kNearestCentreM) {
      faults.push_back({Kind::kCentreInMetres, true, {target.id}, from_base});
      continue;
    }
    Cell alone = cell;
    alone.targets = {target};
    alone.lengths.clear();
    if (find_candidates(alone, arm, Clearance::blind(), {}, kReachTried, Kinds::kSpheresAndPlanes)
            .empty())
      faults.push_back({Kind::kOutOfReach, true, {target.id}, from_base});
  }
}

void check_centre_sigmas(const Cell& cell, std::vector<CellFault>& faults) {
  for (const Target& target : cell.targets) {
    if (target.kind != TargetKind::kSphere || !target.has_centre) continue;
    if (target.diameter_m < kThinnestSphereM) continue;  // in metres
    const double radius = target.diameter_m / 2.0 + cell.tool.tip_radius_m;
    const double most_m = most_centre_sigma_m(radius);
    if (target.centre_sigma_m > most_m)
      faults.push_back({Kind::kRoughCentre, false, {target.id}, target.centre_sigma_m, most_m});
  }
}

void check_certified(const Cell& cell, std::vector<CellFault>& faults) {
  for (const CertifiedLength& one : cell.lengths)
    if (one.sigma_m > kMostCertifiedSigmaM)
      faults.push_back({Kind::kCertifiedSigma, false, {one.from, one.to}, one.sigma_m});
  for (const Target& one : cell.targets)
    if (one.diameter_sigma_m > kMostCertifiedSigmaM)
      faults.push_back({Kind::kCertifiedSigma, false, {one.id}, one.diameter_sigma_m});
}

/// True if the tool has a plausible length; otherwise the reach cannot be judged.
bool check_unit_range(const Cell& cell, std::vector<CellFault>& faults) {
  const double tool = cell.tool.tcp.translation().norm();
  const bool sound = tool <= 0.0 || tool >= kShortestToolM;
  if (!sound) faults.push_back({Kind::kToolInMetres, true, {}, tool});
  for (const Target& target : cell.targets) {
    if (target.kind != TargetKind::kSphere) continue;
    if (target.diameter_m < kThinnestSphereM)
      faults.push_back({Kind::kDiameterInMetres, true, {target.id}, target.diameter_m});
    else if (target.diameter_m < kSmallestUsualM || target.diameter_m > kLargestUsualM)
      faults.push_back({Kind::kUnusualDiameter, false, {target.id}, target.diameter_m});
  }
  for (const Obstacle& obstacle : cell.obstacles) {
    if (obstacle.mesh == nullptr) continue;
    Eigen::AlignedBox3d around;
    for (const Eigen::Vector3d& vertex : obstacle.mesh->vertices_m) around.extend(vertex);
    const Eigen::Vector3d size = around.sizes();
    if (size.maxCoeff() < kSmallestMeshM)
      faults.push_back({Kind::kMeshInMetres,
                        true,
                        {obstacle.id, obstacle.mesh_file},
                        size.x(),
                        size.y(),
                        size.z()});
  }
  if (cell.touch_sigma_m < kFinestTouchM || cell.touch_sigma_m > kCoarsestTouchM)
    faults.push_back({Kind::kTouchSigma, false, {}, cell.touch_sigma_m});
  const auto is_sphere = [](const Target& target) { return target.kind == TargetKind::kSphere; };
  if (cell.radius_offset_sigma_m == 0.0 && std::ranges::any_of(cell.targets, is_sphere))
    faults.push_back({Kind::kRadiusOffset, false});
  return sound;
}

/// Faults at every setting; at a single one the plan goes without.
std::vector<CellFault> faults_at_all_settings(const Cell& cell) {
  std::vector<CellFault> common;
  bool first = true;
  for (const std::vector<double>& setting : settings_of(cell.robot)) {
    const std::vector<CellFault> here = faults_of(at_setting(cell, setting));
    const auto is_here = [&](const CellFault& fault) {
      return std::ranges::any_of(here, [&](const CellFault& one) {
        return one.kind == fault.kind && one.ids == fault.ids;
      });
    };
    if (std::exchange(first, false)) common = here;
    std::erase_if(common, [&](const CellFault& fault) { return !is_here(fault); });
    if (common.empty()) break;
  }
  return common;
}

double mm(double metres) { return metres * 1e3; }

Phrase phrase_of(const DescriptionMistake& mistake) {
  switch (mistake.kind) {
    case DescriptionMistake::Kind::kSign:
      return {"say.cell.sign", {{"sign", mistake.sign}, {"joint", mistake.joint}}};
    case DescriptionMistake::Kind::kOffset:
      return {"say.cell.offset", {{"deg", mistake.offset_deg}, {"joint", mistake.joint}}};
    case DescriptionMistake::Kind::kToolAxis: break;
  }
  return fmt::format("xyz_mm = [{:g}, {:g}, {:g}] of [tool]", mm(mistake.tcp_m.x()),
                     mm(mistake.tcp_m.y()), mm(mistake.tcp_m.z()));
}

Phrase mistakes_of(const CellFault& f) {
  if (f.mistakes.empty()) return "say.cell.do.description.none";
  Phrase all;
  for (const DescriptionMistake& one : f.mistakes) all = joined("say.join.or", all, phrase_of(one));
  if (f.more > 0) all = joined("say.join.or", all, {"say.cell.more", {{"n", f.more}}});
  return {"say.cell.do.description", {{"changes", all}}};
}

/// The sentence of its kind, with all numbers that one may have.
Phrase phrase_of(const CellFault& f, std::string id) {
  const double off_m = f.kind == Kind::kCentre ? f.a_m : std::abs(f.a_m - f.b_m);
  std::vector<PhraseValue> values{{"a", mm(f.a_m)},
                                  {"b", mm(f.b_m)},
                                  {"c", mm(f.c_m)},
                                  {"sigma", mm(f.sigma_m)},
                                  {"sigmas", off_m / f.sigma_m},
                                  {"kg", f.kg},
                                  {"limit", f.limit_kg},
                                  {"meant", mm(f.a_m) / kMmPerM},
                                  {"reached", mm(f.a_m * f.b_m / f.c_m)}};
  for (std::size_t i = 0; i < f.ids.size(); ++i)
    values.emplace_back("id" + std::to_string(i), f.ids[i]);
  return {std::move(id), std::move(values)};
}

}  // namespace

std::optional<CellFault> fault_of(const Cell& cell, const Plan& plan) {
  if (!cell.required_m || !(plan.predicted_mean_m > *cell.required_m)) return std::nullopt;
  return CellFault{Kind::kRequired, false, {}, *cell.required_m, plan.predicted_mean_m};
}

std::optional<CellFault> fault_of(const Cell& cell, const Goal& goal) {
  const double mean_m = goal.u95_m / kBoundOverError;
  if (!cell.required_m || !(mean_m > *cell.required_m)) return std::nullopt;
  return CellFault{Kind::kGoal, false, {}, *cell.required_m, goal.u95_m, mean_m};
}

std::vector<CellFault> faults_of(const Cell& cell) {
  std::vector<CellFault> faults;
  if (const auto& axes = cell.robot.positioner; !axes.empty()) {
    faults = faults_at_all_settings(cell);
    if (std::ranges::none_of(axes, [](const PositionerAxis& one) { return one.mass_kg > 0.0; }))
      faults.push_back({CellFaultKind::kPositionerUnloaded, false, {axes.back().name}});
    return faults;
  }
  const bool tool_is_sound = check_unit_range(cell, faults);
  compare_lengths(cell, faults);
  if (std::ranges::none_of(faults, &CellFault::refused)) {
    compare_lengths_of_one_pair(cell, faults);
    compare_lengths_with_each_other(cell, faults);
  }
  check_certified(cell, faults);
  check_centre_sigmas(cell, faults);
  check_overlaps(cell, faults);
  check_containment(cell, faults);
  examine_load(cell, faults);
  examine_column(cell, faults);
  if (tool_is_sound && reaches_any_turn(cell.robot)) {
    check_reach(cell, faults);
    examine_tool(cell, faults);
    examine_description(cell, faults);
  }
  std::stable_partition(faults.begin(), faults.end(), [](const CellFault& f) { return f.refused; });
  return faults;
}

std::vector<Phrase> refuse_faulty(const Cell& cell, bool by_centres) {
  std::vector<Phrase> warnings;
  std::string refusal;
  for (const CellFault& fault : faults_of(cell)) {
    if (fault.kind == Kind::kRoughCentre && !by_centres) continue;
    if (!fault.refused) {
      warnings.push_back(phrase(fault));
    } else {
      refusal += (refusal.empty() ? "" : "; ") + words(phrase(fault));
    }
  }
  if (!refusal.empty())
    throw PlanError(PlanError::Kind::kCell, "the cell file cannot be right: " + refusal);
  return warnings;
}

Phrase found_phrase(const CellFault& f) {
  std::string id = std::string("say.cell.found.") + own_name(f.kind);
  if (f.kind == Kind::kCertifiedSigma && f.ids.size() == 1) id += ".sphere";
  if (f.kind == Kind::kDescription && f.ids.empty()) id += ".reach";
  return phrase_of(f, id);
}

Phrase advice_phrase(const CellFault& f) {
  if (f.kind == Kind::kDescription) return mistakes_of(f);
  return phrase_of(f, std::string("say.cell.do.") + own_name(f.kind));
}

Phrase phrase(const CellFault& fault) {
  return joined("say.join.remedy", found_phrase(fault), advice_phrase(fault));
}

}  // namespace cellcal::calib
