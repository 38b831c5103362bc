#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <utility>

#include "calib/model/units.h"
#include "calib/verdict/artefacts.h"
#include "calib/verdict/judge.h"

namespace cellcal::calib {

namespace {

/// Limit of the mean 3-D error of a published result, unless the cell file states required_mm:
/// typical of industrial arms as delivered.
constexpr double kRequiredM = 2e-3;
/// Limit relative to the nominal arm's own error, or to the error predicted by its tolerances if
/// the nominal arm is better: above it the touches carry no information on the arm.
constexpr double kOfNominal = 0.8;

struct Foreseen {
  double predicted_m, nominal_m, tolerated_m, required_m;
  std::vector<Quantity> evidence;

  bool as_required() const { return predicted_m <= required_m; }
  bool gains() const { return predicted_m <= kOfNominal * std::max(nominal_m, tolerated_m); }
};

Foreseen foreseen(const Cell& cell, const Calibration& c, bool workspace) {
  Foreseen all{workspace ? c.predicted_workspace_m : c.predicted_near_targets_m,
               workspace ? c.nominal_workspace_m : c.nominal_near_targets_m,
               workspace ? c.tolerated_workspace_m : c.tolerated_near_targets_m,
               cell.required_m.value_or(kRequiredM),
               {}};
  all.evidence = {
      in_mm("predicted", all.predicted_m),
      in_mm("nominal", all.nominal_m),
      in_mm("nominal_u", workspace ? c.nominal_workspace_u_m : c.nominal_near_targets_u_m),
      in_mm("tolerated", all.tolerated_m),
      {"of_nominal", 100.0 * all.predicted_m / all.nominal_m, "%"},
      {"most_of_nominal", 100.0 * kOfNominal, "%"},
      in_mm("required", all.required_m),
      {"required_is_stated", cell.required_m.has_value()},
      {"workspace", workspace}};
  return all;
}

/// Width of the narrowest interval with four fifths of the values: a few outlying ones determine no joint.
double width_of_most(std::vector<double> values) {
  std::ranges::sort(values);
  const std::size_t most = (4 * values.size() + 4) / 5;
  double least = HUGE_VAL;
  for (std::size_t i = 0; i + most <= values.size() && most > 0; ++i)
    least = std::min(least, values[i + most - 1] - values[i]);
  return least;
}

/// Joints that move the tip and that most fit touches have at one angle: their tolerances alone state
/// what they do elsewhere.
std::vector<FindingPart> still_joints(const Problem& problem) {
  constexpr double kStillRad = 5.0 * kRadPerDeg, kTurnRad = 1.0, kMovesM = 5e-3;
  const auto& joints = problem.cell().robot.joints;
  std::vector<std::vector<double>> angles(joints.size());
  std::vector<FindingPart> still;
  for (const Touch& touch : problem.touches())
    for (std::size_t j = 0; j < joints.size() && touch.set == TouchSet::kFit; ++j)
      angles[j].push_back(touch.joint_rad[j]);
  for (std::size_t j = 0; j < joints.size(); ++j) {
    if (joints[j].is_prismatic() || joints[j].errors.empty() ||
        width_of_most(angles[j]) > kStillRad)
      continue;
    JointVector q = problem.touches().front().joint_rad;
    const Eigen::Vector3d before = problem.arm().nominal_tip_m(q);
    q[j] += kTurnRad;
    if ((problem.arm().nominal_tip_m(q) - before).norm() > kMovesM)
      still.push_back({about_joint(joints[j].name), {}});
  }
  return still;
}

/// Certified lengths determine the scale if their combined relative sigma is at most this.
constexpr double kLengthScaleSigma = 5e-4;

/// Each length once, the most certain of those between the same two ends; a length whose ends the
/// touches do not both determine carries no information on the arm.
std::vector<Problem::Length> different_lengths(const Problem& problem,
                                               const std::vector<int>& loose) {
  const auto is_loose = [&](int block) { return std::ranges::count(loose, block) > 0; };
  std::vector<Problem::Length> different;
  for (const Problem::Length& length : problem.lengths()) {
    if (length.is_check || is_loose(length.block_a) || is_loose(length.block_b)) continue;
    const auto known =
        std::find_if(different.begin(), different.end(), [&](const Problem::Length& other) {
          return std::minmax(length.block_a, length.block_b) ==
                 std::minmax(other.block_a, other.block_b);
        });
    if (known == different.end())
      different.push_back(length);
    else if (length.sigma_m < known->sigma_m)
      *known = length;
  }
  return different;
}

bool hold_scale(const std::vector<Problem::Length>& lengths) {
  double information = 0.0;
  for (const Problem::Length& length : lengths)
    information += std::pow(length.length_m / length.sigma_m, 2);  // (54)
  return information * kLengthScaleSigma * kLengthScaleSigma >= 1.0;
}

/// True if other data than its certificate determine the length well enough for the scale, or it
/// was measured twice. A certificate listed twice does not count.
bool is_checked(const Calibration& c, const LengthResult& length) {
  return length.sigma_m < kLengthScaleSigma * length.certified_m ||
         std::any_of(c.lengths.begin(), c.lengths.end(), [&](const LengthResult& other) {
           return same_ends(length, other) && other.certified_m != length.certified_m;
         });
}

/// If the scale depends on a single certificate, or the touches check none by the others.
std::optional<Finding> unchecked_lengths(const Calibration& c, std::size_t holding) {
  const auto checked = [&](const LengthResult& length) { return is_checked(c, length); };
  if (c.lengths.empty() || std::ranges::any_of(c.lengths, checked)) return std::nullopt;
  const LengthResult& best = *std::ranges::min_element(c.lengths, {}, least_seen_error_m);
  return Finding{holding > 1 ? FindingKind::kUncheckedLengths : FindingKind::kUncheckedLength,
                 Severity::kWarns,
                 about_length(best.from, best.to),
                 {in_mm("unseen", least_seen_error_m(best)),
                  in_mm("certified", best.certified_m, best.certified_sigma_m),
                  {"lengths", holding}}};
}

/// Reason for a scope limited to the targets, and the remedy.
Finding near_targets(const Problem& problem, const HeldPlaces& places, const Scale& scale) {
  const auto any = [&](const auto& is) {
    return std::ranges::any_of(problem.blocks(), [&](const TargetBlock& block) {
      return is(problem.cell().targets[block.target].kind);
    });
  };
  return {FindingKind::kScaleByNothing,
          Severity::kInforms,
          {},
          {{"lengths", problem.fitted_lengths()},
           {"lengths_with_held_ends", scale.lengths.size()},
           {"loose_targets", places.loose.size()},
           {"spheres", any([](TargetKind kind) { return kind == TargetKind::kSphere; })},
           {"centres", any(has_a_centre)}}};
}

/// An arm this many tolerances off nominal is another arm: real ones stay within five (real-data
/// tests); a wrong row of the robot file leads to twenty and more and can still fit. The lower
/// limit is a warning.
constexpr double kFarFromNominal = 6.0, kBeyondTolerance = 4.0;
/// All lengths of an arm together: limit of chance in sigmas.
constexpr double kFarScale = 4.0;
/// Sigmas by which the arm itself may be off in the opposite direction.
constexpr double kLuck = 2.0;
/// Effective radius, in sigmas of its prior: limit of the warning, and of the refusal.
constexpr double kWarnedRadius = 2.0, kFarRadius = 3.0;

/// True if it is not caused by one length alone.
bool is_of_all_lengths(const Problem& problem, const Calibration& c, const ArmScale& scale) {
  constexpr double kFarWithoutOne = 2.0;
  for (int p = 0; p < problem.arm_size(); ++p) {
    const ArmScale others = arm_scale(problem, c, p);
    if (!(others.off * scale.off > 0.0) || !(std::abs(others.off) > kFarWithoutOne * others.sigma))
      return false;
  }
  return true;
}

/// Errors of more than `most` tolerances, the largest first.
std::vector<FindingPart> beyond_tolerance(const Problem& problem, const Calibration& c,
                                          double most) {
  std::vector<FindingPart> far;
  for (int p = 0; p < problem.arm_size(); ++p) {
    const ParameterKind kind = problem.arm().parameters()[p].kind;
    if (!is_geometric(kind) && kind != ParameterKind::kTcp) continue;
    const ParameterResult& found = c.parameters[static_cast<std::size_t>(p)];
    const double tolerances = std::abs(found.correction) / problem.unknowns()[p].scale;
    if (!(tolerances > most)) continue;
    far.push_back(
        {about_parameter(c.cell, found.key),
         {{"off", found.correction * found.to_unit, found.unit}, {"tolerances", tolerances}}});
  }
  std::ranges::stable_sort(far, std::greater{}, [](const FindingPart& one) {
    return value(one.evidence, "tolerances");
  });
  return far;
}

/// Effective radius that differs from the files' values; empty within `most` sigmas.
std::optional<Finding> radius_off(const Problem& problem, const Calibration& c, double most,
                                  Severity severity) {
  int worst = -1;
  for (int tool = 0; tool < problem.arm().tool_count(); ++tool) {
    const int rho = problem.rho(tool);
    if (rho >= 0 &&
        (worst < 0 || std::abs(c.parameters[static_cast<std::size_t>(rho)].correction) >
                          std::abs(c.parameters[static_cast<std::size_t>(worst)].correction)))
      worst = rho;
  }
  if (worst < 0) return std::nullopt;
  const ParameterResult& rho = c.parameters[static_cast<std::size_t>(worst)];
  const double sigma_m = problem.unknowns()[static_cast<std::size_t>(worst)].scale;
  if (!(std::abs(rho.correction) > most * sigma_m)) return std::nullopt;
  return Finding{
      FindingKind::kEffectiveRadius,
      severity,
      about_parameter(c.cell, rho.key),
      {in_mm("off", rho.correction), {"apart", std::abs(rho.correction) / sigma_m, "sigma"}}};
}

}  // namespace

bool holds_where_measured(const Cell& cell, const Calibration& c) {
  if (c.region.empty() || cell.required_m || !(c.nominal_workspace_m > 0.0)) return false;
  const Foreseen near = foreseen(cell, c, false);
  return near.as_required() && near.gains();
}

void shrink_scope(const Problem& problem, const Calibration& c, bool determined, Verdict& verdict) {
  const Cell& cell = problem.cell();
  auto still = still_joints(problem);
  const Foreseen all = foreseen(cell, c, true), near = foreseen(cell, c, false);
  if (cell.required_m || !verdict.workspace || !(c.nominal_workspace_m > 0.0) ||
      (determined && still.empty() && all.as_required() && all.gains()) || !near.as_required() ||
      !near.gains())
    return;
  verdict.workspace = false;
  verdict.add(
      {FindingKind::kScopeOfTouches,
       still.empty() ? Severity::kInforms : Severity::kWarns,
       {},
       {in_mm("workspace_predicted", all.predicted_m), in_mm("predicted", near.predicted_m)},
       std::move(still)});
}

void judge_predicted(const Cell& cell, const Calibration& c, Verdict& verdict) {
  if (!(c.nominal_workspace_m > 0.0)) return;
  const Foreseen all = foreseen(cell, c, verdict.workspace);
  if (!all.as_required())
    verdict.add({FindingKind::kRequired, Severity::kWithholds, {}, all.evidence});
  if (!all.gains()) verdict.add({FindingKind::kNoGain, Severity::kWithholds, {}, all.evidence});
}

void note_gain(const Cell& cell, const Calibration& c, Verdict& verdict) {
  if (!(c.nominal_workspace_m > 0.0)) return;
  verdict.add(
      {FindingKind::kGain, Severity::kInforms, {}, foreseen(cell, c, verdict.workspace).evidence});
}

void note_model_error(const Problem& problem, const Calibration& c, Verdict& verdict) {
  const Discrepancy& d = c.discrepancy;
  if (!(d.sigma_m > 0.0)) return;
  Finding finding{FindingKind::kModelError,
                  Severity::kWarns,
                  {},
                  {in_mm("sigma", d.sigma_m),
                   {"estimated", d.estimated},
                   in_mm("scatter", c.touch_noise_m),
                   in_mm("noise", d.noise_m),
                   in_mm("stated", problem.cell().touch_sigma_m)}};
  if (c.repeats.degrees_of_freedom > 0.0)
    finding.evidence.push_back(in_mm("repeats", c.repeats.scatter_m));
  if (d.reach_rad > 0.0) finding.evidence.push_back(in_deg("reach", d.reach_rad));
  verdict.add(std::move(finding));
}

Scale scale_of(const Problem& problem, const HeldPlaces& places) {
  Scale scale;
  scale.lengths = different_lengths(problem, places.loose);
  scale.by_lengths = hold_scale(scale.lengths);
  scale.by_readings = places.rule != nullptr;
  return scale;
}

void note_scope(const Problem& problem, const Calibration& c, const HeldPlaces& places,
                const Scale& scale, Verdict& verdict) {
  const ArmScale arm = arm_scale(problem, c);
  if (scale.by_readings)
    verdict.add({FindingKind::kScaleByReadings, Severity::kInforms, about_target(*places.rule)});
  // Wires belong to one instrument, and share its scale error.
  const bool alone = scale.by_readings && !scale.by_lengths && places.trackers <= 1 &&
                     (places.trackers == 0 || places.wires == 0);
  if (alone && arm.sigma > 0.0)
    verdict.add({FindingKind::kUncheckedReadings,
                 Severity::kWarns,
                 {},
                 {{"unseen", 100.0 * arm.unseen(), "%"}}});
  if (scale.by_lengths) {
    Finding finding{
        FindingKind::kScaleByLengths, Severity::kInforms, {}, {{"lengths", scale.lengths.size()}}};
    // Only the arm's tolerances contradict an error common to all certificates.
    if (scale.lengths.size() > 1 && !scale.by_readings && arm.sigma > 0.0)
      finding.evidence.push_back({"unseen", 100.0 * arm.unseen(), "%"});
    verdict.add(std::move(finding));
    if (auto unchecked = unchecked_lengths(c, scale.lengths.size()))
      verdict.add(std::move(*unchecked));
  }
  if (!scale.held()) verdict.add(near_targets(problem, places, scale));
}

double ArmScale::unseen() const { return (kFarScale + kLuck) * sigma; }

ArmScale arm_scale(const Problem& problem, const Calibration& c, int but) {
  double information = 0.0, pull = 0.0;
  for (int p = 0; p < problem.arm_size(); ++p) {
    const ParameterKind kind = problem.arm().parameters()[p].kind;
    if ((kind != ParameterKind::kD && kind != ParameterKind::kA) || p == but) continue;
    const Joint& joint =
        problem.arm().robot().joints[static_cast<std::size_t>(problem.arm().parameters()[p].joint)];
    const double drawn_m = kind == ParameterKind::kD ? joint.d_m : joint.a_m;
    const double square = std::pow(problem.unknowns()[p].scale, 2);
    information += drawn_m * drawn_m / square;
    pull += drawn_m * c.parameters[static_cast<std::size_t>(p)].correction / square;
  }
  if (!(information > 0.0)) return {};
  return {pull / information, 1.0 / std::sqrt(information)};  // (57)
}

void judge_nominal_geometry(const Problem& problem, const Calibration& c, Verdict& verdict) {
  constexpr double kAnotherArm = 50.0;
  const ArmScale scale = arm_scale(problem, c);
  if (scale.sigma > 0.0 && std::abs(scale.off) > kFarScale * scale.sigma &&
      is_of_all_lengths(problem, c, scale))
    verdict.add({FindingKind::kArmScale,
                 Severity::kWithholds,
                 {},
                 {{"off", 100.0 * scale.off, "%", 100.0 * scale.sigma},
                  {"apart", std::abs(scale.off) / scale.sigma, "sigma"}}});
  std::vector<FindingPart> far = beyond_tolerance(problem, c, kFarFromNominal);
  if (far.empty()) return;
  const bool may_be_so = value(far.front().evidence, "tolerances") < kAnotherArm;
  verdict.add({FindingKind::kOffNominal,
               Severity::kWithholds,
               {},
               {{"may_be_so", may_be_so}},
               std::move(far)});
}

void judge_radius(const Problem& problem, const Calibration& c, Verdict& verdict) {
  if (auto off = radius_off(problem, c, kFarRadius, Severity::kWithholds))
    verdict.add(std::move(*off));
}

void note_tolerances(const Problem& problem, const Calibration& c, Verdict& verdict) {
  if (auto off = radius_off(problem, c, kWarnedRadius, Severity::kWarns))
    verdict.add(std::move(*off));
  std::vector<FindingPart> far = beyond_tolerance(problem, c, kBeyondTolerance);
  if (!far.empty())
    verdict.add({FindingKind::kOffNominal, Severity::kWarns, {}, {}, std::move(far)});
}

}  // namespace cellcal::calib
