#include "calib/identify/identify.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>
#include <variant>

#include "calib/estimate/discrepancy.h"
#include "calib/estimate/joint_functions.h"
#include "calib/estimate/target.h"
#include "calib/identify/causes.h"
#include "calib/identify/identify_once.h"
#include "calib/identify/jump.h"
#include "calib/verdict/artefacts.h"
#include "calib/verdict/residuals.h"
#include "calib/verdict/session_order.h"
#include "calib/verdict/verdict.h"

namespace cellcal::calib {

namespace {

bool moved_alone(const std::vector<Cause>& causes) {
  return std::ranges::all_of(causes, [](const Cause& c) { return c.moved.has_value(); });
}

bool is_moved(const std::vector<MovedTarget>& moved, const std::string& target) {
  return std::ranges::find(moved, target, &MovedTarget::target) != moved.end();
}

bool has_two_places(const Cell& cell, const std::string& target) {
  return has_two_places(cell.targets[cell.target_index(target)].kind);
}

/// Confirms a move that was found while certified lengths held the targets, by a search without
/// lengths: wrong lengths also displace targets, and a moved target contradicts correct lengths.
void confirm_without_lengths(const Cell& cell, const std::vector<Touch>& touches,
                             const IdentifyOptions& options, Calibration& calibration) {
  if (calibration.lengths.empty()) return;
  auto& findings = calibration.verdict.findings;
  const Cell changed = silenced(cell);
  std::optional<Calibration> without = tried(changed, touches, options);
  if (!without) return;  // the touches alone determine nothing and so do not contradict it
  without->moved = calibration.moved;
  confirm_moves(changed, touches, options, covered_m(calibration), *without);
  if (!without->moved.empty()) {
    calibration.lengths.clear();  // the position that they refer to is unknown
    erase(findings, FindingKind::kCertifiedLength);
    erase(findings, FindingKind::kCertifiedTwice);
    return;
  }
  if (!findings.empty() && findings.front().kind == FindingKind::kMovedTarget)
    findings.front().evidence.push_back({"or_lengths", 1.0, ""});
}

/// True if so many touches were excluded that a move or jump is possible; gross errors have the
/// same effect.
bool many_left_out(const Cell& cell, const std::vector<Touch>& touches, const Calibration& c) {
  FitTouches all;
  for (const Target& target : cell.targets) {
    const FitTouches own = fit_touches_of(target.id, touches, c);
    if (own.left_out > 1 && 5 * own.left_out >= own.all) return true;
    all.all += own.all;
    all.left_out += own.left_out;
  }
  return 10 * all.left_out > all.all;
}

/// Returns true and withholds the result if one jump during the session explains the touches; a
/// target's jump is reported as a move.
bool explained_by_jump(const Cell& cell, const std::vector<Touch>& touches,
                       const IdentifyOptions& options, Calibration& calibration) {
  // A specified level may omit properties of the arm, which resembles jumps.
  if (options.level) return false;
  if (calibration.verdict.publish() && calibration.jumped.empty() && calibration.moved.empty() &&
      !many_left_out(cell, touches, calibration))
    return false;
  constexpr double kUnlikely = -5.0;  // log odds
  const std::vector<Jump> all = jumps_by_odds(cell, touches, options, calibration);
  std::erase_if(calibration.moved, [&](const MovedTarget& moved) {
    return std::ranges::any_of(all, [&](const Jump& jump) {
      return jump.what == Jump::What::kTarget && jump.name == moved.target &&
             jump.log_odds < kUnlikely;
    });
  });
  const std::vector<Jump> jumps = confirmed_jumps(cell, touches, covered_m(calibration), all);
  calibration.jumped.clear();
  if (jumps.empty()) return false;
  // If the session stays inconsistent with the jump undone, the other findings are reported.
  if (!jumps.front().mends && !calibration.verdict.publish()) return false;
  if (jumps.size() > 1 || jumps.front().what != Jump::What::kTarget) {
    calibration.moved.clear();
    calibration.jumped = jumps;
    withhold_for_jumps(cell, touches, options, calibration);
    return true;
  }
  withhold_for_move(cell, touches, jumps.front(), calibration);
  confirm_without_lengths(cell, touches, options, calibration);
  erase(calibration.verdict.findings, FindingKind::kManyOutliers);
  erase(calibration.verdict.findings, FindingKind::kOutliersOfTarget);
  return true;
}

/// For planes: true if a move is likelier than an unmodelled error of the arm.
bool likelier_than_model_error(const Cell& cell, const std::vector<Touch>& touches,
                               const IdentifyOptions& options, const MovedTarget& moved) {
  if (has_two_places(cell, moved.target)) return true;
  const TwoPlaces two = as_two(cell, touches, moved.target, moved.after_touch);
  return log_evidence_with_model(two.cell, two.touches, options) >
         log_evidence_with_model(cell, touches, options) + kConfirmedOdds;
}

/// A wrong length is measured by the fit without it; the fit with it is spoilt.
void measure_by(const Finding& cause, Verdict& verdict) {
  const Quantity* measured = find(cause.evidence, "measured");
  if (cause.cause != LikelyCause::kCertifiedLength || measured == nullptr) return;
  for (Finding& one : verdict.findings) {
    if (one.kind != FindingKind::kCertifiedLength || one.about != cause.about) continue;
    const Quantity certified = *find(one.evidence, "certified");
    for (Quantity& quantity : one.evidence) {
      if (quantity.name == "measured") quantity = *measured;
      if (quantity.name == "apart")
        quantity.value = std::abs(measured->value - certified.value) /
                         std::hypot(measured->sigma, certified.sigma);
    }
  }
}

/// Adds the causes, likeliest first, before all other findings.
void add(const std::vector<Finding>& causes, Verdict& verdict) {
  for (auto one = causes.rbegin(); one != causes.rend(); ++one) {
    measure_by(*one, verdict);
    verdict.add_first(*one);
  }
}

std::vector<Finding> findings_of(const std::vector<Cause>& causes) {
  std::vector<Finding> findings;
  for (const Cause& cause : causes) findings.push_back(cause.finding);
  return findings;
}

/// True if the touches show, or may show, an error of the arm beyond the model.
bool shows_discrepancy(const Calibration& c) {
  constexpr double kTooMuch = 4.0, kTooMuchUnlessNoise = 2.0, kEnoughRepeats = 5.0;
  // Functions take such an error for theirs where touches are few; with_discrepancy() decides by evidence. Of many
  // touches it takes seconds.
  constexpr std::size_t kFewTouches = 300;
  const bool functions = has_functions(c.cell.robot);
  const bool sensitive = functions || c.repeats.degrees_of_freedom >= kEnoughRepeats;
  return c.touch_noise_m > kNothingM &&
         (c.discrepancy.alike > kFieldSigmas ||
          c.chi2_per_dof > (sensitive ? kTooMuchUnlessNoise : kTooMuch) ||
          (functions && c.residuals.size() <= kFewTouches));
}

/// True if the field is likelier than the functions of the joints' angles, by the evidence of the same touches.
bool likelier_than_functions(const Cell& cell, const std::vector<Touch>& touches,
                             IdentifyOptions with_field, const Calibration& field,
                             const Calibration& functions) {
  if (touches.size() <= kMostTouchesOfField) return field.log_evidence > functions.log_evidence;
  std::vector<Touch> some;
  for (const std::size_t i : share_of(touches, kMostTouchesOfField)) some.push_back(touches[i]);
  const auto one = tried(cell, some, with_field);
  with_field.with_discrepancy = false;
  const auto other = tried(cell, some, with_field);
  return one && other && one->log_evidence > other->log_evidence;
}

/// Calibration with the discrepancy estimated, if the residuals show one and, where the arm has functions of its joints'
/// angles, it is likelier than those. If both are withheld, `stated` with the findings of the other as warnings.
Calibration with_discrepancy(const Cell& cell, const std::vector<Touch>& touches,
                             IdentifyOptions options, Calibration stated) {
  if (options.level || options.with_discrepancy || !shows_discrepancy(stated)) return stated;
  options.with_discrepancy = true;
  std::optional<Calibration> estimated = tried(cell, touches, options);
  if (!estimated) return stated;
  if (has_functions(stated.cell.robot) &&
      !likelier_than_functions(cell, touches, options, *estimated, stated))
    return stated;
  estimated->discrepancy.alike = stated.discrepancy.alike;
  if (estimated->verdict.publish() || stated.verdict.publish()) return std::move(*estimated);
  for (const Finding& one : estimated->verdict.findings) {
    if (!one.withholds()) continue;
    Finding still{FindingKind::kStillWithModelError, Severity::kWarns, one.about};
    still.still = {one};
    stated.verdict.add(std::move(still));
  }
  return stated;
}

/// Adds the likely causes of a withheld result, and jumps or moves during the session. All further
/// identifications use tried(), so that nothing here throws IdentifyError.
Calibration diagnosed_result(const Cell& cell, const std::vector<Touch>& touches,
                             const IdentifyOptions& options, const OtherRobots& other_robots,
                             Calibration calibration) {
  if (const auto wrong = wrong_measure(cell, touches, options, calibration)) {
    calibration.moved.clear();  // a wrong length displaces spheres
    add({*wrong}, calibration.verdict);
    return calibration;
  }
  // With so few touches any hypothesis would explain them.
  if (calibration.verdict.too_few()) return calibration;
  if (explained_by_jump(cell, touches, options, calibration)) return calibration;
  std::vector<Cause> causes;
  if (!calibration.verdict.publish()) causes = causes_of(cell, touches, other_robots);
  std::erase_if(causes, [&](const Cause& cause) {
    return cause.moved && !likelier_than_model_error(cell, touches, options, *cause.moved);
  });
  // Other mistakes displace targets too.
  const bool moved = moved_alone(causes);
  if (!moved) calibration.moved.clear();
  for (const Cause& cause : causes)
    if (moved && has_two_places(cell, cause.moved->target) &&
        !is_moved(calibration.moved, cause.moved->target))
      calibration.moved.push_back(*cause.moved);
  confirm_moves(cell, touches, options, covered_m(calibration), calibration);
  if (!calibration.moved.empty()) confirm_without_lengths(cell, touches, options, calibration);
  // An apparent move without which the result would be published may be another mistake.
  if (!calibration.moved.empty() && causes.empty()) {
    causes = causes_of(cell, touches, other_robots);
    if (!causes.empty() && causes.front().moved) causes.clear();
  }
  if (calibration.moved.empty() || !moved_alone(causes))
    add(findings_of(causes), calibration.verdict);
  if (calibration.moved.empty() && causes.empty())
    calibration = with_discrepancy(cell, touches, options, std::move(calibration));
  if (!calibration.verdict.publish() && calibration.moved.empty() && causes.empty())
    if (const auto scattered = scattered_touches(cell, touches))
      calibration.verdict.add_first(*scattered);
  return calibration;
}

}  // namespace

std::vector<Finding> likely_causes(const Cell& cell, const std::vector<Touch>& touches,
                                   const OtherRobots& other_robots) {
  std::vector<Finding> findings = findings_of(causes_of(cell, touches, other_robots));
  if (findings.empty())
    if (auto scattered = scattered_touches(cell, touches)) findings.push_back(*scattered);
  return findings;
}

Calibration identify(const Cell& cell, const std::vector<Touch>& touches,
                     const IdentifyOptions& options, const OtherRobots& other_robots) {
  require_sound(cell, touches);
  auto stated = identified_or_why_not(cell, touches, options, true);
  if (const auto* why_not = std::get_if<IdentifyError>(&stated)) {
    Calibration nominal = not_identified(cell, touches, options, why_not->what());
    add(likely_causes(cell, touches, other_robots), nominal.verdict);
    return nominal;
  }
  Calibration calibration = diagnosed_result(cell, touches, options, other_robots,
                                             std::get<Calibration>(std::move(stated)));
  warn_of_unchecked_touch(touches, calibration);
  return calibration;
}

}  // namespace cellcal::calib
