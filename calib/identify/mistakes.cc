// Wrong artefacts in the cell file: diameters, certified lengths, centres.

#include "calib/identify/mistakes.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "calib/estimate/target.h"
#include "calib/identify/causes.h"
#include "calib/identify/jump.h"
#include "calib/model/linear.h"
#include "calib/model/units.h"
#include "calib/verdict/artefacts.h"
#include "calib/verdict/residuals.h"
#include "calib/verdict/session_order.h"

namespace cellcal::calib {

namespace {

/// mm per unit: metres, micrometres, inches.
constexpr double kUnitsMm[] = {kMmPerM, 1.0 / kMmPerM, 25.4};

/// Tests the session without this length and those between the same ends.
void without_length(const Asked& asked, const CertifiedLength& wrong) {
  const auto same = [&](const CertifiedLength& l) { return same_ends(l, wrong); };
  asked.ask({silenced(asked.cell, same), asked.touches, [&](const Calibration& c) {
               Finding finding =
                   likely(LikelyCause::kCertifiedLength, about_length(wrong.from, wrong.to),
                          {in_mm("stated", wrong.length_m)});
               const auto its = std::ranges::find_if(
                   c.lengths, [&](const LengthResult& l) { return is_of(l, wrong); });
               if (its != c.lengths.end())
                 finding.evidence.push_back(in_mm("measured", its->by_others_m, its->sigma_m));
               return finding;
             }});
}

}  // namespace

namespace mistakes {

void diameters(const Asked& asked) {
  constexpr double kAnyRadiusM = 0.01;
  asked.with_cell([](Cell& cell) { cell.radius_offset_sigma_m = kAnyRadiusM; },
                  [](const Calibration& c) {
                    const double rho_m =
                        correction_of(c, tool_parameter(ParameterKind::kEffectiveRadius, 0));
                    return likely(LikelyCause::kAllDiameters, {}, {in_mm("off", 2.0 * rho_m)});
                  });
  for (std::size_t t = 0; t < asked.cell.targets.size(); ++t) {
    const Target& target = asked.cell.targets[t];
    if (target.kind != TargetKind::kSphere) continue;
    asked.with_cell([&](Cell& cell) { cell.targets[t].diameter_sigma_m = 2.0 * kAnyRadiusM; },
                    [&](const Calibration& c) {
                      const double radius_m =
                          correction_of(c, target_parameter(ParameterKind::kRadius, t));
                      return likely(LikelyCause::kDiameter, about_target(target),
                                    {in_mm("off", 2.0 * radius_m)});
                    });
  }
}

/// One wrong length, two exchanged ones, or all in another unit.
void certified_lengths(const Asked& asked) {
  const auto& lengths = asked.cell.lengths;
  for (std::size_t k = 0; k < std::min(kMostPairs, lengths.size()); ++k) {
    const auto here = lengths.begin() + static_cast<std::ptrdiff_t>(k);
    if (std::none_of(lengths.begin(), here,
                     [&](const CertifiedLength& l) { return same_ends(l, *here); }))
      without_length(asked, *here);
  }
  for_each_pair(lengths.size(), [&](std::size_t a, std::size_t b) {
    asked.with_cell(
        [=](Cell& cell) { std::swap(cell.lengths[a].length_m, cell.lengths[b].length_m); },
        always(likely(LikelyCause::kExchangedLengths, {}, {},
                      {{about_length(lengths[a].from, lengths[a].to), {}},
                       {about_length(lengths[b].from, lengths[b].to), {}}})));
  });
  if (lengths.empty()) return;
  for (const double mm : kUnitsMm)
    asked.with_cell(
        [=](Cell& cell) {
          for (CertifiedLength& length : cell.lengths) length.length_m *= mm;
        },
        always(likely(LikelyCause::kLengthsUnit, {}, {{"unit", mm, "mm"}})));
}

void contradicted_length(const Asked& asked) {
  const auto wrong = std::ranges::find_if(
      asked.cell.lengths, [&](const CertifiedLength& l) { return is_of(*asked.contradicted, l); });
  if (wrong != asked.cell.lengths.end()) without_length(asked, *wrong);
}

void lengths_of_an_end(const Asked& asked) {
  const auto& lengths = asked.cell.lengths;
  for (const std::string& end : {asked.contradicted->from, asked.contradicted->to}) {
    const auto of_end = [&](const CertifiedLength& l) { return l.from == end || l.to == end; };
    const auto own = std::ranges::count_if(lengths, of_end);
    // Without any length everything would be consistent.
    if (own < 2 || own == static_cast<std::ptrdiff_t>(lengths.size())) continue;
    const Target& target = asked.cell.targets[asked.cell.target_index(end)];
    asked.ask({silenced(asked.cell, of_end), asked.touches,
               always(likely(LikelyCause::kLengthsOfTarget, about_target(target),
                             {{"lengths", static_cast<double>(own), ""}}))});
  }
}

void all_lengths(const Asked& asked) {
  asked.ask({silenced(asked.cell), asked.touches, always(likely(LikelyCause::kAllLengths))});
}

/// Stated centres as starting values only: of each target whose centre is held, and of all of them.
void stated_centres(const Asked& asked) {
  Hypothesis none{asked.cell, asked.touches, always(likely(LikelyCause::kAllCentres))};
  std::size_t held = 0;
  for (std::size_t t = 0; t < asked.cell.targets.size(); ++t) {
    const Target& target = asked.cell.targets[t];
    if (!centre_is_held(target)) continue;
    const auto unheld = [t](Cell& c) { c.targets[t].centre_sigma_m = 0.0; };
    unheld(none.cell);
    if (++held > kMostTargets) continue;
    asked.with_cell(unheld, [&](const Calibration& c) {
      Eigen::Vector3d centre_m = Eigen::Vector3d::Zero();
      for (const TargetResult& one : c.targets)
        if (one.id == target.id) centre_m = one.centre_m;
      return likely(LikelyCause::kStatedCentre, about_target(target),
                    {in_mm("off", (centre_m - target.centre_m).norm())});
    });
  }
  none.changes = held;
  if (held > 1) asked.ask(none);
}

}  // namespace mistakes

// Recorded or entered data that differ from the measurement.

namespace {

/// Sets of trackers and wires whose readings may be wrong: each one, all of a kind, and all.
std::vector<std::vector<std::string>> sets_of_readings(const Cell& cell) {
  std::vector<std::vector<std::string>> sets;
  std::vector<std::string> all, of_kind;
  for (const TargetKind kind : {TargetKind::kTracker, TargetKind::kWire}) {
    of_kind.clear();
    for (const Target& target : cell.targets)
      if (target.kind == kind) of_kind.push_back(target.id);
    all.insert(all.end(), of_kind.begin(), of_kind.end());
    if (!of_kind.empty()) sets.push_back(of_kind);
    if (of_kind.size() > 1 && of_kind.size() <= kMostTargets)
      for (const std::string& id : of_kind) sets.push_back({id});
  }
  if (!of_kind.empty() && all.size() > of_kind.size()) sets.push_back(all);
  return sets;
}

void ask_for_names(const Asked& asked, const Names& names) {
  asked.ask(
      {asked.cell, names.given_to(asked.cell, asked.touches), always(names.cause(asked.cell))});
}

/// Displacement of a target [m], at the touched points: for planes along the normal, for trackers
/// by the frame.
double moved_by_m(const TargetResult& before, const TargetResult& after) {
  if (before.kind == TargetKind::kPlane)
    return std::abs(after.normal.dot(before.centre_m) - after.distance_m);
  if (before.kind == TargetKind::kTracker)
    return (after.frame * (before.frame.inverse() * before.centre_m) - before.centre_m).norm();
  return (after.centre_m - before.centre_m).norm();
}

TargetResult result_of(const Calibration& c, const std::string& id) {
  const auto its = std::ranges::find(c.targets, id, &TargetResult::id);
  return its == c.targets.end() ? TargetResult{} : *its;
}

}  // namespace

void Asked::with_cell(const std::function<void(Cell&)>& change, FindingOf cause) const {
  Hypothesis without{cell, touches, std::move(cause)};
  change(without.cell);
  ask(without);
}

void Asked::with_touches(const std::function<void(Touch&)>& change, FindingOf cause,
                         bool no_farther) const {
  Hypothesis without{cell, touches, std::move(cause), no_farther};
  for (Touch& touch : without.touches) change(touch);
  ask(without);
}

void for_each_pair(std::size_t size, const std::function<void(std::size_t, std::size_t)>& ask) {
  std::size_t asked = 0;
  for (std::size_t a = 0; a < size; ++a)
    for (std::size_t b = a + 1; b < size && asked < kMostPairs; ++b, ++asked) ask(a, b);
}

namespace mistakes {

void radians(const Asked& asked) {
  double largest = 0.0;
  const std::size_t first = asked.cell.robot.first_turning();
  for (const Touch& touch : asked.touches)
    for (std::size_t i = first; i < touch.joint_rad.size(); ++i)
      largest = std::max(largest, std::abs(touch.joint_rad[i]) * kDegPerRad);
  if (largest > kRadPerTurn) return;  // degrees, as expected
  asked.with_touches(
      [first](Touch& touch) {
        for (std::size_t i = first; i < touch.joint_rad.size(); ++i)
          touch.joint_rad[i] *= kDegPerRad;
      },
      always(likely(LikelyCause::kRadians, {}, {{"largest", largest, "deg"}})));
}

void axis_signs(const Asked& asked) {
  const auto& joints = asked.cell.robot.joints;
  for (std::size_t i = asked.cell.robot.first_turning(); i < joints.size(); ++i)
    asked.with_touches([i](Touch& touch) { touch.joint_rad[i] = -touch.joint_rad[i]; },
                       always(likely(LikelyCause::kAxisSign, about_joint(joints[i].name))), true);
}

/// An axis with lost mastering.
void mastering(const Asked& asked) {
  constexpr double kAnyZeroRad = 0.1;
  for (std::size_t i = asked.cell.robot.first_turning(); i < asked.cell.robot.joints.size(); ++i) {
    const Joint& joint = asked.cell.robot.joints[i];
    const auto off_rad = [&](const Calibration& c) {
      const double off = correction_of(c, joint_parameter(ParameterKind::kTheta, i));
      return std::remainder(joint.sign * off, kRadPerTurn);
    };
    Cell loose = asked.cell;
    loose.robot.joints[i].errors = {JointError::kTheta};  // else another angle takes its share
    loose.robot.joints[i].tolerance_angle_rad = kAnyZeroRad;
    const Trial trial = fit_hypothesis(loose, asked.touches);
    if (!trial.found) continue;
    const double about_rad = off_rad(*trial.found);
    if (!(std::abs(about_rad) > 2.0 * joint.tolerance_angle_rad)) continue;
    asked.with_touches([&](Touch& touch) { touch.joint_rad[i] += about_rad; },
                       [&](const Calibration& c) {
                         return likely(LikelyCause::kMastering, about_joint(joint.name),
                                       {in_deg("add", about_rad + off_rad(c))});
                       });
  }
}

void exchanged_columns(const Asked& asked) {
  const auto& joints = asked.cell.robot.joints;
  for_each_pair(joints.size(), [&](std::size_t a, std::size_t b) {
    if (joints[a].is_prismatic()) return;
    asked.with_touches(
        [=](Touch& touch) { std::swap(touch.joint_rad[a], touch.joint_rad[b]); },
        always(likely(LikelyCause::kExchangedColumns, {}, {},
                      {{about_joint(joints[a].name), {}}, {about_joint(joints[b].name), {}}})),
        true);
  });
}

void target_names(const Asked& asked) {
  for_each_pair(asked.cell.targets.size(), [&](std::size_t a, std::size_t b) {
    Names names(asked.cell);
    std::swap(names.of[a], names.of[b]);
    ask_for_names(asked, names);
  });
  // Cyclic permutation of three or more targets.
  if (const auto names = better_names(asked.cell, asked.touches); names && names->changed() > 2)
    ask_for_names(asked, *names);
}

void names_by_lengths(const Asked& asked) {
  if (const auto names = better_names(asked.cell, asked.touches)) ask_for_names(asked, *names);
}

/// Readings of trackers and wires in other units, or of a left-handed tracker.
void readings(const Asked& asked) {
  const Cell& cell = asked.cell;
  for (const auto& ids : sets_of_readings(cell)) {
    std::vector<FindingPart> of;
    for (const std::string& id : ids)
      of.push_back({about_target(cell.targets[cell.target_index(id)]), {}});
    const auto ask = [&](double factor, double x_factor, const Finding& finding, bool no_farther) {
      asked.with_touches(
          [&](Touch& touch) {
            if (std::ranges::find(ids, touch.target) == ids.end()) return;
            touch.radius_m *= factor;
            for (double& m : touch.tracker_m) m *= factor;
            touch.tracker_m[0] *= x_factor;
          },
          always(finding), no_farther);
    };
    for (const double mm : kUnitsMm)
      ask(mm, 1.0, likely(LikelyCause::kReadingsUnit, {}, {{"unit", mm, "mm"}}, of), true);
    if (cell.targets[cell.target_index(ids.front())].kind == TargetKind::kTracker)
      ask(1.0, -1.0, likely(LikelyCause::kReadingsHandedness, {}, {}, of), false);
  }
}

/// A target that moved after a quarter, half or three quarters of its touches.
void moved(const Asked& asked) {
  constexpr std::size_t kLeast = 4;  // on either side
  const std::vector<std::size_t> order = in_order(asked.touches);
  for (const Target& target : asked.cell.targets) {
    std::vector<std::size_t> own;
    for (const std::size_t i : order)
      if (asked.touches[i].target == target.id && asked.touches[i].set == TouchSet::kFit)
        own.push_back(i);
    for (const std::size_t quarter : {1, 2, 3}) {
      const std::size_t split = own.size() * quarter / 4;
      if (split < kLeast || own.size() - split < kLeast) continue;
      const TwoPlaces two = as_two(asked.cell, asked.touches, target.id, own[split - 1]);
      Hypothesis moved{two.cell, two.touches};
      moved.moved = MovedTarget{target.id, asked.among[own[split - 1]]};
      moved.cause = [&](const Calibration& c) {
        const std::size_t first = own[split];
        const double shift_m = moved_by_m(result_of(c, target.id), result_of(c, two.later));
        Finding finding =
            likely(LikelyCause::kMoved,
                   after(about_target(target), asked.among[first], asked.touches[first]),
                   {in_mm("shift", shift_m)});
        add_rank(asked.all, asked.among[first], finding.evidence);
        return finding;
      };
      asked.ask(moved);
    }
  }
}

}  // namespace mistakes

// Wrong artefacts in the cell file: a certified length, a diameter, the zero of a wire, the
// position of a target.

namespace {

/// The calibration, if it is published and no move is confirmed.
std::optional<Calibration> sensible(const Cell& cell, const std::vector<Touch>& touches,
                                    const IdentifyOptions& options) {
  std::optional<Calibration> calibration = tried(cell, touches, options);
  if (!calibration) return {};
  confirm_moves(cell, touches, options, 0.0, *calibration);
  if (!calibration->moved.empty() || !calibration->verdict.publish()) return {};
  return calibration;
}

/// Bias for which the session is consistent, if there is one.
std::optional<ArtefactBias> mended_bias(const Cell& cell, const std::vector<Touch>& touches,
                                        const IdentifyOptions& options, ArtefactBias bias) {
  constexpr int kSteps = 4;  // the first one includes the outliers due to the wrong size
  for (int step = 0; step < kSteps; ++step) {
    const PutRight right = put_right(cell, touches, bias);
    if (is_of_sphere(cell, bias) &&
        right.cell.targets[cell.target_index(bias.target)].diameter_m < 0.0)
      return std::nullopt;
    const auto found = tried(right.cell, right.touches, options);
    if (!found) return std::nullopt;
    const auto own = std::ranges::find(found->artefact_biases, bias.target, &ArtefactBias::target);
    if (own == found->artefact_biases.end()) return std::nullopt;
    bias.off_m += own->off_m;
    bias.sigma_m = own->sigma_m;
    if (contradiction(*own) < 1.0) break;
  }
  const PutRight right = put_right(cell, touches, bias);
  return sensible(right.cell, right.touches, options) ? std::optional(bias) : std::nullopt;
}

/// Median residual of all fit touches of a wire, excluded ones included.
double median_residual_m(const Calibration& c, const std::vector<Touch>& touches,
                         const std::string& target) {
  std::vector<double> all;
  for (const TouchResidual& r : c.residuals)
    if (touches[r.touch].target == target && touches[r.touch].set == TouchSet::kFit)
      all.push_back(r.after_m);
  return all.empty() ? 0.0 : median(std::move(all));
}

/// Sizes contradicted by all other measurements, most contradicted first; before them, for targets
/// with mostly excluded touches, the sizes that would readmit these.
std::vector<ArtefactBias> suspected_biases(const Cell& cell, const std::vector<Touch>& touches,
                                           const IdentifyOptions& options,
                                           const Calibration& calibration) {
  constexpr double kAboutAsMuch = 0.7, kAnyDiameterM = 0.02;
  constexpr std::size_t kMost = 3;
  std::vector<ArtefactBias> suspects;
  for (const Target& target : cell.targets) {
    if (suspects.size() == kMost) break;
    const FitTouches own = fit_touches_of(target.id, touches, calibration);
    if (2 * own.left_out <= own.all) continue;
    if (target.kind == TargetKind::kWire)
      suspects.push_back({target.id, median_residual_m(calibration, touches, target.id), 0.0});
    if (target.kind != TargetKind::kSphere) continue;
    Cell loose = cell;
    loose.targets[cell.target_index(target.id)].diameter_sigma_m = kAnyDiameterM;
    const auto found = tried(loose, touches, options);
    const auto radius = target_parameter(ParameterKind::kRadius, cell.target_index(target.id));
    if (const ParameterResult* p = found ? find(*found, radius) : nullptr)
      suspects.push_back({target.id, p->correction, p->sigma});
  }
  if (const ArtefactBias* worst = worst_contradicted(calibration.artefact_biases)) {
    std::vector<ArtefactBias> contradicted = calibration.artefact_biases;
    std::erase_if(contradicted, [&](const ArtefactBias& bias) {
      return contradiction(bias) < kAboutAsMuch * contradiction(*worst) ||
             std::ranges::find(suspects, bias.target, &ArtefactBias::target) != suspects.end();
    });
    std::ranges::stable_sort(contradicted, std::greater<>(),
                             [](const ArtefactBias& one) { return contradiction(one); });
    contradicted.resize(std::min(kMost, contradicted.size()));
    suspects.insert(suspects.end(), contradicted.begin(), contradicted.end());
  }
  return suspects;
}

/// Corrected size for the finding.
FindingPart size_of(const Cell& cell, const ArtefactBias& bias) {
  if (bias.target.empty()) return {{}, {in_mm("longer", bias.off_m, bias.sigma_m)}};
  const Target& target = cell.targets[cell.target_index(bias.target)];
  if (!is_of_sphere(cell, bias))
    return {about_target(target), {in_mm("longer", bias.off_m, bias.sigma_m)}};
  return {about_target(target),
          {in_mm("measured", target.diameter_m + 2.0 * bias.off_m, 2.0 * bias.sigma_m),
           in_mm("stated", target.diameter_m)}};
}

/// Wrong diameter or wire zero, if one is contradicted; several if the touches do not distinguish
/// them. nullopt if no single one resolves the contradiction.
std::optional<Finding> wrong_size(const Cell& cell, const std::vector<Touch>& touches,
                                  const IdentifyOptions& options, const Calibration& calibration) {
  constexpr double kLikely = 10.0;  // squared sigmas relative to the likeliest: e^-5
  struct Mended {
    FindingPart size;
    double misfit;
  };
  std::vector<Mended> all;
  double least = std::numeric_limits<double>::infinity();
  for (const ArtefactBias& bias : suspected_biases(cell, touches, options, calibration)) {
    const auto mended = mended_bias(cell, touches, options, bias);
    if (!mended) continue;
    const PutRight right = put_right(cell, touches, *mended);
    all.push_back({size_of(cell, *mended), fit_hypothesis(right.cell, right.touches).sum});
    least = std::min(least, all.back().misfit);
  }
  Finding finding = likely(LikelyCause::kArtefactSize);
  for (Mended& one : all)
    if (one.misfit < least + kLikely) finding.parts.push_back(std::move(one.size));
  if (finding.parts.empty()) return {};
  if (!cell.lengths.empty()) finding.evidence = {{"lengths", 1.0, ""}};
  return finding;
}

}  // namespace

std::optional<Finding> wrong_measure(const Cell& cell, const std::vector<Touch>& touches,
                                     const IdentifyOptions& options,
                                     const Calibration& calibration) {
  const LengthResult* length = worst_contradicted(calibration.lengths);
  const ArtefactBias* bias = worst_contradicted(calibration.artefact_biases);
  std::optional<Finding> found;
  Asked asked{.cell = cell, .touches = touches, .ask = {}, .contradicted = length};
  asked.ask = [&](const Hypothesis& without) {
    if (found) return;
    if (const auto c = sensible(without.cell, without.touches, options)) found = without.cause(*c);
  };
  const auto ask_for = [&](Mistake mistake) {
    if (!found && length != nullptr) mistake(asked);
  };
  const bool size_first = length && bias && contradiction(*bias) > contradiction(*length);
  if (!size_first) ask_for(mistakes::contradicted_length);
  if (!found) found = wrong_size(cell, touches, options, calibration);
  if (size_first) ask_for(mistakes::contradicted_length);
  // No single artefact is the cause.
  ask_for(mistakes::names_by_lengths);
  ask_for(mistakes::stated_centres);
  ask_for(mistakes::lengths_of_an_end);
  ask_for(mistakes::all_lengths);
  if (!found) return {};
  found->evidence.push_back({"mends", 1.0, ""});
  return found;
}

}  // namespace cellcal::calib
