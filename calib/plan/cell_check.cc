// Sentences of cell file faults: the number first, then the remedy.

#include "calib/plan/cell_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <regex>

#include "calib/model/units.h"
#include "calib/plan/bodies.h"
#include "calib/plan/candidates.h"
#include "calib/plan/clearance.h"
#include "calib/plan/online.h"
#include "calib/plan/pool.h"
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
/// Smaller values were probably stated in metres.
constexpr double kShortestToolM = 0.005, kNearestCentreM = 0.020, kThinnestSphereM = 0.001;
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

/// Also applies without stated centres.
void compare_lengths_with_each_other(const Cell& cell, std::vector<CellFault>& faults) {
  const auto between = [&](const std::string& a, const std::string& b) -> const CertifiedLength* {
    for (const CertifiedLength& length : cell.lengths)
      if ((length.from == a && length.to == b) || (length.from == b && length.to == a))
        return &length;
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
  for (const Target& target : cell.targets)
    if (target.kind == TargetKind::kSphere && target.diameter_m < kThinnestSphereM)
      faults.push_back({Kind::kDiameterInMetres, true, {target.id}, target.diameter_m});
  if (cell.touch_sigma_m < kFinestTouchM || cell.touch_sigma_m > kCoarsestTouchM)
    faults.push_back({Kind::kTouchSigma, false, {}, cell.touch_sigma_m});
  return sound;
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
  const bool tool_is_sound = check_unit_range(cell, faults);
  compare_lengths(cell, faults);
  if (faults.empty()) compare_lengths_with_each_other(cell, faults);
  check_certified(cell, faults);
  check_overlaps(cell, faults);
  check_containment(cell, faults);
  examine_load(cell, faults);
  examine_column(cell, faults);
  if (tool_is_sound) {
    check_reach(cell, faults);
    examine_tool(cell, faults);
    examine_description(cell, faults);
  }
  std::stable_partition(faults.begin(), faults.end(), [](const CellFault& f) { return f.refused; });
  return faults;
}

std::vector<std::string> refuse_faulty(const Cell& cell) {
  std::vector<std::string> warnings;
  std::string refusal;
  for (const CellFault& fault : faults_of(cell)) {
    if (!fault.refused) {
      warnings.push_back(words(fault));
    } else {
      refusal += (refusal.empty() ? "" : "; ") + words(fault);
    }
  }
  if (!refusal.empty())
    throw PlanError(PlanError::Kind::kCell, "the cell file cannot be right: " + refusal);
  return warnings;
}

namespace {

using Kind = CellFaultKind;
using Eigen::Vector3d;

/// Arms may carry more than their rated payload close to the flange.
constexpr double kOverloaded = 1.5;
/// Above the payload of any articulated robot (KR 1000 titan, FANUC M-2000: 2300 kg).
constexpr double kAnyPayloadKg = 2500.0;
/// Shares of the column's radius and height within which an object is inside the column.
constexpr double kInColumn = 0.5, kAboveBase = 0.3;
/// Clearance of the tool from its sphere during a touch (clearance.h).
constexpr double kTouchMarginM = 0.005;
/// A tip at less than this share of its distance along the flange's axis points across it.
constexpr double kAcross = 0.1;
constexpr double kShortToolM = 0.05;
constexpr int kTried = 20;
constexpr std::size_t kMostMistakes = 3;

/// The arm without obstacles except the floor.
Cell alone(const Cell& cell) {
  Cell bare = cell;
  bare.targets.clear();
  bare.lengths.clear();
  bare.obstacles.clear();
  return bare;
}

std::optional<Hit> hit_at_rest(const Cell& cell) {
  const Cell bare = alone(cell);
  const ArmModel arm = planning_arm(bare);
  const Clearance clearance(bare, arm);
  return clearance.hit(resting_posture(bare.robot, clearance), kTipMarginM);
}

/// True if each target with a stated place can be touched, ignoring obstacles.
bool reaches_all(const Cell& cell) {
  const Cell bare = alone(cell);
  const ArmModel arm = planning_arm(bare);
  for (const Target& target : cell.targets) {
    if (!is_planned(target, Kinds::kSpheresAndPlanes) || !target.has_centre) continue;
    Cell one = bare;
    one.targets = {target};
    if (find_candidates(one, arm, Clearance(bare, arm), {}, kTried, Kinds::kSpheresAndPlanes)
            .empty())
      return false;
  }
  return true;
}

bool explains(const Cell& cell) { return !hit_at_rest(cell) && reaches_all(cell); }

/// Each single change of the description that makes the arm rest clear and reach all targets: signs, tool along
/// Z, offsets.
std::vector<DescriptionMistake> explain(const Cell& cell) {
  using What = DescriptionMistake::Kind;
  std::vector<DescriptionMistake> all;
  Cell other = cell;
  for (Joint& joint : other.robot.joints) {
    if (joint.is_prismatic()) continue;
    joint.sign = -joint.sign;
    if (explains(other))
      all.push_back({.kind = What::kSign, .joint = joint.name, .sign = joint.sign});
    joint.sign = -joint.sign;
  }
  other.tool.tcp.translation() = cell.tool.tcp.translation().norm() * Vector3d::UnitZ();
  if (explains(other))
    all.push_back({.kind = What::kToolAxis, .tcp_m = other.tool.tcp.translation()});
  other.tool = cell.tool;
  for (Joint& joint : other.robot.joints) {
    if (joint.is_prismatic()) continue;
    const double stated = joint.offset_rad;
    for (const double turn : {std::numbers::pi, std::numbers::pi / 2, -std::numbers::pi / 2}) {
      joint.offset_rad = std::remainder(stated + turn, 2.0 * std::numbers::pi);
      if (explains(other))
        all.push_back({.kind = What::kOffset,
                       .joint = joint.name,
                       .offset_deg = joint.offset_rad * kDegPerRad});
    }
    joint.offset_rad = stated;
  }
  return all;
}

}  // namespace

double rated_payload_kg(const Robot& robot) {
  static const std::regex kModel(R"(\b(?:KR|iiwa) ?(\d{1,4})(?:-\d)?(?: L(\d{1,4}))?\b)");
  std::smatch found;
  if (!std::regex_search(robot.name, found, kModel)) return 0.0;
  return std::stod(found[2].matched ? found[2].str() : found[1].str());
}

void examine_load(const Cell& cell, std::vector<CellFault>& faults) {
  const double rated_kg = rated_payload_kg(cell.robot);
  const double limit_kg = rated_kg > 0.0 ? rated_kg : kAnyPayloadKg;
  double kg = cell.tool.mass_kg;
  for (const Tool& tool : cell.other_tools) kg += tool.mass_kg;
  if (kg <= limit_kg) return;
  CellFault fault{Kind::kToolTooHeavy, rated_kg <= 0.0 || kg > kOverloaded * rated_kg};
  fault.kg = kg;
  fault.limit_kg = limit_kg;
  faults.push_back(fault);
}

void examine_column(const Cell& cell, std::vector<CellFault>& faults) {
  // A linear unit's column moves, and keeps clear of everything.
  if (cell.robot.joints.size() < 3 || cell.obstacles.empty() || cell.robot.first_turning() > 0)
    return;
  const ArmModel arm = planning_arm(cell);
  ArmChain chain;
  arm.walk(arm.prepare(JointVector(cell.robot.joints.size(), 0.0)), arm.errors(nullptr), chain);
  const Vector3d foot = chain.link[0].z_origin, axis = chain.link[0].z;
  const double height = (chain.link[1].z_origin - foot).dot(axis);
  const Segment column{foot + kAboveBase * height * axis, foot + height * axis};
  const double stated = cell.robot.joints[0].radius_m;
  const double limit = kInColumn * (stated > 0.0 ? stated : assumed_radius_m(cell.robot));
  Cell obstacles = alone(cell);
  obstacles.obstacles = cell.obstacles;
  obstacles.floor_m.reset();
  const Surroundings things(obstacles);
  for (std::size_t i = 0; i < things.size(); ++i) {
    const double gap = things.distance_m(i, column, 2.0 * limit);
    if (gap < limit) faults.push_back({Kind::kInColumn, true, {things.words(i)}, gap, limit});
  }
}

void examine_tool(const Cell& cell, std::vector<CellFault>& faults) {
  const Tool& tool = cell.tool;
  const Vector3d tip = tool.tcp.translation();
  const double beside = tip.head<2>().norm();
  if (tip.norm() > kShortToolM && std::abs(tip.z()) < kAcross * tip.norm())
    faults.push_back({Kind::kToolAcross, false, {}, tip.z(), beside});
  const double clear_m = PlanOptions{}.clear_m;
  if (tool.tip_radius_m > clear_m)
    faults.push_back({Kind::kLargeBall, false, {}, tool.tip_radius_m, clear_m});
  // The default slim end is used if none is stated.
  const bool stated = tool.slim_radius_m != Tool{}.slim_radius_m;
  if (stated && tool.tip_radius_m > 0.0 && tool.tip_radius_m < tool.slim_radius_m)
    faults.push_back({Kind::kShankTouchesFirst, false, {}, tool.tip_radius_m, tool.slim_radius_m});
  const bool has_shaft = tip.norm() > tool.slim_length_m;
  const double needed = tool.radius_m + kTouchMarginM - tool.tip_radius_m;
  if (has_shaft && tool.slim_length_m < needed)
    faults.push_back({Kind::kShaftTouchesFirst, true, {}, tool.slim_length_m, needed});
}

void examine_description(const Cell& cell, std::vector<CellFault>& faults) {
  const auto out_of_reach = [](const CellFault& fault) { return fault.kind == Kind::kOutOfReach; };
  if (std::any_of(faults.begin(), faults.end(),
                  [&](const CellFault& fault) { return fault.refused && !out_of_reach(fault); }))
    return;
  const auto stated = std::count_if(cell.targets.begin(), cell.targets.end(), [](auto& target) {
    return is_planned(target, Kinds::kSpheresAndPlanes) && target.has_centre;
  });
  const auto missed = std::count_if(faults.begin(), faults.end(), out_of_reach);
  const bool reaches_none = missed > 1 && missed == stated;
  const std::optional<Hit> hit = hit_at_rest(cell);
  if (!hit && !reaches_none) return;
  CellFault fault{Kind::kDescription, true};
  if (hit) fault.ids = {words(*hit)};
  fault.mistakes = explain(cell);
  if (!hit && fault.mistakes.empty()) return;
  if (fault.mistakes.size() > kMostMistakes) {
    fault.more = fault.mistakes.size() - kMostMistakes;
    fault.mistakes.resize(kMostMistakes);
  }
  if (!fault.mistakes.empty()) std::erase_if(faults, out_of_reach);
  faults.push_back(fault);
}

namespace {

using Kind = CellFaultKind;

double mm(double metres) { return metres * 1e3; }

std::string length_words(const CellFault& f) {
  return fmt::format(
      "certified length {}-{}: {:.3f} mm stated, {:.1f} +- {:.1f} mm between the stated centres "
      "({:.0f} sigma)",
      f.ids[0], f.ids[1], mm(f.a_m), mm(f.b_m), mm(f.sigma_m), std::abs(f.a_m - f.b_m) / f.sigma_m);
}

std::string words_of(const DescriptionMistake& mistake) {
  switch (mistake.kind) {
    case DescriptionMistake::Kind::kSign:
      return fmt::format("sign = {} of {}", mistake.sign, mistake.joint);
    case DescriptionMistake::Kind::kOffset:
      return fmt::format("offset_deg = {:.0f} of {}", mistake.offset_deg, mistake.joint);
    case DescriptionMistake::Kind::kToolAxis:
      break;
  }
  return fmt::format("xyz_mm = [{:g}, {:g}, {:g}] of [tool]", mm(mistake.tcp_m.x()),
                     mm(mistake.tcp_m.y()), mm(mistake.tcp_m.z()));
}

std::string mistake_words(const CellFault& f) {
  if (f.mistakes.empty())
    return "No arm can rest like that: correct robot file, [tool] and floor_mm";
  std::string all;
  for (const DescriptionMistake& one : f.mistakes)
    all += (all.empty() ? "" : ", or ") + words_of(one);
  if (f.more > 0) all += fmt::format(", or {} more", f.more);
  return "Likely mistake in the robot file or [tool]: " + all + " would fit";
}

}  // namespace

std::string found_words(const CellFault& f) {
  switch (f.kind) {
    case Kind::kLength:
    case Kind::kSurfaces:
    case Kind::kDecimalPoint:
      return length_words(f);
    case Kind::kCentresExchanged:
      return fmt::format(
          "the centres of {} and {} are exchanged: the other way round they fit all "
          "certified lengths",
          f.ids[0], f.ids[1]);
    case Kind::kCentre:
      return fmt::format(
          "centre of {}: up to {:.1f} mm off certified lengths that end there ({:.0f} "
          "sigma), and all others fit",
          f.ids[0], mm(f.a_m), f.a_m / f.sigma_m);
    case Kind::kLengthTooShort:
      return fmt::format("certified length {}-{}: {:.3f} mm, less than the {:.1f} mm of both radii",
                         f.ids[0], f.ids[1], mm(f.a_m), mm(f.b_m));
    case Kind::kTriangle:
      return fmt::format(
          "certified length {0}-{1}: {3:.3f} mm, longer than {0}-{2} and {2}-{1} "
          "together ({4:.3f} mm)",
          f.ids[0], f.ids[1], f.ids[2], mm(f.a_m), mm(f.b_m));
    case Kind::kOverlap:
      return fmt::format("spheres {} and {}: {:.1f} mm between centres, {:.1f} mm of both radii",
                         f.ids[0], f.ids[1], mm(f.a_m), mm(f.b_m));
    case Kind::kInside:
      return fmt::format("sphere {}: {:.1f} mm deep in {}", f.ids[0], mm(f.a_m), f.ids[1]);
    case Kind::kOutOfReach:
      return fmt::format(
          "target {}: {:.0f} mm from the base's origin, and no posture inside the "
          "joint limits touches it",
          f.ids[0], mm(f.a_m));
    case Kind::kCentreInMetres:
      return fmt::format("target {}: {:.3f} mm from the base's origin", f.ids[0], mm(f.a_m));
    case Kind::kToolInMetres:
      return fmt::format("tool: the tip lies {:.3f} mm from the flange", mm(f.a_m));
    case Kind::kDiameterInMetres:
      return fmt::format("sphere {}: {:.4f} mm of diameter", f.ids[0], mm(f.a_m));
    case Kind::kTouchSigma:
      return fmt::format("touch: sigma_mm = {:g}", mm(f.a_m));
    case Kind::kCertifiedSigma:
      return f.ids.size() > 1
                 ? fmt::format("certified length {}-{}: sigma_mm = {:g}", f.ids[0], f.ids[1],
                               mm(f.a_m))
                 : fmt::format("sphere {}: diameter_sigma_mm = {:g}", f.ids[0], mm(f.a_m));
    case Kind::kToolTooHeavy:
      return fmt::format("tool: {:g} kg, limit {:g} kg (rated payload of the robot)", f.kg,
                         f.limit_kg);
    case Kind::kInColumn:
      return fmt::format(
          "{}: {:.0f} mm from the robot's axis A1, limit {:.0f} mm: the column is there", f.ids[0],
          mm(f.a_m), mm(f.b_m));
    case Kind::kLargeBall:
      return fmt::format(
          "tool: a ball of {:.1f} mm radius at the tip, limit {:.1f} mm (clearance of a plan)",
          mm(f.a_m), mm(f.b_m));
    case Kind::kShaftTouchesFirst:
      return fmt::format(
          "tool: {:.1f} mm from tip to shaft, at least {:.1f} mm needed: the shaft meets a sphere before the tip",
          mm(f.a_m), mm(f.b_m));
    case Kind::kShankTouchesFirst:
      return fmt::format(
          "tool: a ball of {:.1f} mm radius on a slim end of {:.1f} mm radius: the side meets a sphere before the ball",
          mm(f.a_m), mm(f.b_m));
    case Kind::kToolAcross:
      return fmt::format(
          "tool: the tip lies {:.0f} mm along the flange's Z axis and {:.0f} mm across it",
          mm(f.a_m), mm(f.b_m));
    case Kind::kDescription:
      return f.ids.empty() ? "arm: no posture inside the joint limits touches any target"
                           : fmt::format("arm: in every resting posture {}", f.ids[0]);
    case Kind::kGoal:
      return fmt::format(
          "required_mm = {:.3f}, a goal of {:.3f} mm leads to a mean error of about {:.3f} mm",
          mm(f.a_m), mm(f.b_m), mm(f.c_m));
    case Kind::kRequired:
      return fmt::format("required_mm = {:.3f}, the plan reaches {:.3f} mm", mm(f.a_m), mm(f.b_m));
  }
  return {};
}

std::string advice_words(const CellFault& f) {
  switch (f.kind) {
    case Kind::kLength:
      return "Compare the certificate and both centre_mm, in the robot's base frame";
    case Kind::kSurfaces:
      return "The difference is both radii: a certified length lies between centres, not surfaces";
    case Kind::kDecimalPoint:
      return fmt::format("Look at the decimal point: {:.3f} mm would fit", mm(f.c_m));
    case Kind::kCentresExchanged:
      return "Exchange their centre_mm, or their ids";
    case Kind::kCentre:
      return "Measure its centre_mm again, in the robot's base frame";
    case Kind::kLengthTooShort:
      return "A certified length lies between centres; look at unit and decimal point";
    case Kind::kTriangle:
      return "One of the three is wrong: compare the certificate";
    case Kind::kOverlap:
      return "Correct one centre_mm";
    case Kind::kInside:
      return "Correct its centre_mm, or place and size of what it is in";
    case Kind::kOutOfReach:
      return "Correct its centre_mm, place it nearer, or look at robot and [tool]";
    case Kind::kCentreInMetres:
      return "centre_mm may be in metres. State it in millimetres, in the robot's base frame";
    case Kind::kToolInMetres:
      return "xyz_mm of [tool] may be in metres. State it in millimetres";
    case Kind::kDiameterInMetres:
      return "diameter_mm may be in metres. State it in millimetres";
    case Kind::kTouchSigma:
      return "sigma_mm may be in another unit. State it in millimetres; 0.03 is usual";
    case Kind::kCertifiedSigma:
      return fmt::format(
          "Certificates state 0.0002 to 0.1 mm. If {:g} um is meant, state {:g} (mm)", mm(f.a_m),
          mm(f.a_m) / kMmPerM);
    case Kind::kToolTooHeavy:
      return "Correct mass_kg of [tool] (kilograms), or use the file of the robot that carries it";
    case Kind::kInColumn:
      return "Correct its place and size, in the robot's base frame. A pedestal ends at the base";
    case Kind::kLargeBall:
      return "tip_radius_mm is the radius, not the diameter. Correct it, or use a smaller ball";
    case Kind::kShaftTouchesFirst:
      return "Correct tip_length_mm and radius_mm of [tool], or use a longer tip";
    case Kind::kShankTouchesFirst:
      return "Correct tip_radius_mm and tip_diameter_mm of [tool], or use a thinner shank";
    case Kind::kToolAcross:
      return "Compare xyz_mm of [tool] with the pendant's tool data: most tools point along Z";
    case Kind::kDescription:
      return mistake_words(f);
    case Kind::kGoal:
      return fmt::format("Ask for a goal of {:.3f} mm, or state a larger required_mm",
                         mm(f.a_m * f.b_m / f.c_m));
    case Kind::kRequired:
      return "Make more touches in more varied postures, or state a larger required_mm";
  }
  return {};
}

std::string words(const CellFault& fault) {
  return found_words(fault) + ". " + advice_words(fault);
}

}  // namespace cellcal::calib
