#include "calib/diagnose/jump.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <utility>

#include "calib/consistency/jump_sequence.h"
#include "calib/consistency/lengths.h"
#include "calib/consistency/session_order.h"
#include "calib/estimate/discrepancy.h"
#include "calib/model/error.h"
#include "calib/model/units.h"
#include "calib/verdict/identify_as_stated.h"

namespace cellcal::calib {

namespace {

/// Less is not worth identifying anew without it.
constexpr double kWorthTrying = 9.0;
/// Of more touches a share says what jumped as well, and all would take longer only.
constexpr std::size_t kMostTouches = 1000;
/// What leaving a touch out costs in log evidence: as much as a touch at the gate.
constexpr double kLeftOut = kJumpGate * kJumpGate / 2.0;
/// By which log evidence a jump has to beat that nothing changed, and to beat another jump.
constexpr double kBelieved = 6.0;
constexpr double kClear = 5.0;
/// Squared sigmas of its size, found with it undone: what is likelier with any jump at all, however
/// large, is something else (a target's touches that bear another's name).
constexpr double kSized = 16.0;

/// How likely the touches are, whatever level, arm and places; each one that was left out costs as
/// much as one at the gate. Natural logarithm.
double log_evidence(const Cell& cell, const std::vector<Touch>& touches, const Calibration& c) {
  // Levels are compared for given noise. That of repeats is measured anew with each jump undone.
  double of_noise = 0.0;
  if (c.repeats.used_m > 0.0)
    for (const Touch& touch : touches) {
      if (touch.set != TouchSet::kFit || touch.sigma_m > 0.0) continue;
      const TargetKind kind = cell.targets[cell.target_index(touch.target)].kind;
      const int rows = kind == TargetKind::kPoint || kind == TargetKind::kTracker ? 3 : 1;
      of_noise += rows * std::log(c.repeats.used_m / cell.touch_sigma_m);
    }

  double best = -std::numeric_limits<double>::infinity(), sum = 0.0;
  for (const LevelEvidence& l : c.levels) best = std::max(best, l.log_evidence);
  for (const LevelEvidence& l : c.levels) sum += std::exp(l.log_evidence - best);
  return best + std::log(sum) - of_noise - kLeftOut * static_cast<double>(c.outliers.size());
}

/// By which the density of a jump is below that of a small one: heavy tails (Student's t, three
/// degrees of freedom), since what is knocked hard is knocked all the same.
double surprise(const Eigen::VectorXd& size, double usual) {
  constexpr double kFreedom = 3.0;
  return 0.5 * (kFreedom + static_cast<double>(size.size())) *
         std::log1p(size.squaredNorm() / (kFreedom * usual * usual));
}

/// The same touches by an arm that did not jump: a joint turned by as much, or, for the tool, the
/// joints at which the tip would have been there.
void undo(const ArmModel& arm, const JumpSuspect& suspect, const Eigen::VectorXd& size,
          Touch& touch) {
  if (suspect.what == Jump::What::kJoint) {
    touch.joint_rad[suspect.index] += size[0];
    return;
  }
  const int tool = arm.tool_index(touch.tool);
  const Eigen::Isometry3d flange =
      arm.nominal_tcp(touch.joint_rad, tool) * arm.tool(tool).tcp.inverse();
  const Eigen::Vector3d there =
      arm.nominal_tip_m(touch.joint_rad, tool) + flange.linear() * Eigen::Vector3d(size);
  constexpr int kSteps = 3;
  constexpr double kDamping = 1e-4;  // [m^2], of posture in which the tip hardly moves one way
  for (int step = 0; step < kSteps; ++step) {
    const Eigen::MatrixXd by = arm.nominal_jacobian(touch.joint_rad).topRows<3>();
    const Eigen::Matrix3d square =
        by * by.transpose() + kDamping * kDamping * Eigen::Matrix3d::Identity();
    const Eigen::VectorXd turn =
        by.transpose() * square.ldlt().solve(there - arm.nominal_tip_m(touch.joint_rad, tool));
    for (std::size_t i = 0; i < touch.joint_rad.size(); ++i)
      touch.joint_rad[i] += turn[static_cast<Eigen::Index>(i)];
  }
}

/// Whether nothing else is wrong. Check touches near the jump may be on its wrong side, and one or
/// two touches near it left out for that.
bool mended(const Calibration& c) {
  constexpr double kMostLeftOut = 0.1;
  constexpr double kStillTooMuch =
      2.5;  // squared sigmas; what an arm does beside its model may jump
  if (c.chi2_per_dof > kStillTooMuch) return false;
  if (static_cast<double>(c.outliers.size()) > kMostLeftOut * c.before.count) return false;
  return std::all_of(c.verdict.findings.begin(), c.verdict.findings.end(), [](const Finding& one) {
    return !one.withholds() || one.kind == FindingKind::kCheckTouches ||
           one.kind == FindingKind::kManyOutliers || one.kind == FindingKind::kOutliersOfTarget;
  });
}

/// What the arm does beside its model looks like a jump where the touches go from place to place,
/// and is still there when that is undone: then nothing speaks for it.
double unless_field(double log_odds, const Calibration& undone) {
  return undone.discrepancy.alike > kFieldSigmas ? std::min(0.0, log_odds) : log_odds;
}

/// Everything that is asked of one session.
class Search {
 public:
  Search(const Cell& cell, const std::vector<Touch>& touches, const IdentifyOptions& options,
         const Calibration& calibration)
      : cell_(cell),
        touches_(touches),
        options_(options),
        stated_(cell, touches, calibration),
        log_evidence_(log_evidence(cell, touches, calibration)),
        in_order_(in_order(touches)) {
    for (const Outlier& o : calibration.outliers) ++left_out_[touches[o.touch].target];
    for (const MovedTarget& m : calibration.moved) left_out_[m.target] += touches.size();
  }

  /// Of one that is known.
  double log_odds(const Jump& known) const {
    for (const JumpSuspect& suspect : stated_.suspects()) {
      if (suspect.what != known.what || suspect.name != known.name) continue;
      FoundJump found;
      while (found.behind + 1 < stated_.order().size() &&
             stated_.order()[found.behind] != known.after_touch)
        ++found.behind;
      if (++found.behind >= stated_.order().size()) return 0.0;
      if (known.what == Jump::What::kJoint)
        found.size = Eigen::VectorXd::Constant(1, known.angle_rad);
      else
        found.size = known.shift_m;
      double chi2 = 1.0;
      const auto jump = known.what == Jump::What::kTarget ? moved(suspect, found, chi2)
                                                          : undone(suspect, found, chi2);
      if (jump) return jump->log_odds / chi2;
    }
    return 0.0;
  }

  std::vector<Jump> all() const {
    std::vector<Jump> jumps;
    double scatter = 1.0, always = 0.0;
    double best = -std::numeric_limits<double>::infinity();
    for (const JumpSuspect& suspect : stated_.suspects()) {
      if (suspect.what == Jump::What::kTarget && !worth_a_look(suspect.name)) continue;
      const auto found = stated_.robust(suspect);
      if (!found || found->squared_sigmas < kWorthTrying) continue;
      std::optional<Jump> jump;
      double chi2 = 1.0;
      try {
        jump = suspect.what == Jump::What::kTarget ? moved(suspect, *found, chi2)
                                                   : undone(suspect, *found, chi2);
      } catch (const IdentifyError&) {
        continue;  // too little on one side to tell
      }
      if (!jump) continue;
      if (suspect.what != Jump::What::kTarget && jump->log_odds > kBelieved)
        always = std::max(always, log_odds_of_always(suspect, *jump));
      if (jump->log_odds > best) {
        best = jump->log_odds;
        scatter = std::max(1.0, chi2);
      }
      jumps.push_back(*jump);
    }
    // Touches that scatter more than stated say less.
    for (Jump& jump : jumps)
      jump.log_odds = (jump.log_odds - always) / scatter -  // (62)
                      std::log(static_cast<double>(stated_.order().size()));
    return jumps;
  }

 private:
  /// Of many targets those that are suspected already, or of which most touches are left out.
  bool worth_a_look(const std::string& target) const {
    constexpr std::size_t kMostTargets = 8;
    if (cell_.targets.size() <= kMostTargets) return true;
    const auto own = left_out_.find(target);
    if (own == left_out_.end()) return false;
    const auto louder = std::count_if(left_out_.begin(), left_out_.end(), [&](const auto& other) {
      return other.second > own->second;
    });
    return louder < static_cast<std::ptrdiff_t>(kMostTargets);
  }

  std::vector<Touch> with_undone(const JumpSuspect& suspect, const FoundJump& found) const {
    std::vector<Touch> touches = touches_;
    bool passed = found.behind == 0;
    for (const std::size_t i : in_order_) {
      passed = passed || i == stated_.order()[found.behind];
      if (passed) undo(stated_.problem().arm(), suspect, found.size, touches[i]);
    }
    return touches;
  }

  /// That it was so all along: an arm mastered wrongly, or another tool. What is far off then fits
  /// as well with a jump after the first few touches, which are given up.
  double log_odds_of_always(const JumpSuspect& suspect, const Jump& jump) const {
    FoundJump always;
    always.size = jump.shift_m;
    if (suspect.what == Jump::What::kJoint)
      always.size = Eigen::VectorXd::Constant(1, jump.angle_rad);
    const std::vector<Touch> touches = with_undone(suspect, always);
    try {
      return log_evidence(cell_, touches, identify_as_stated(cell_, touches, options_)) -
             log_evidence_ - surprise(always.size, suspect.usual);
    } catch (const IdentifyError&) {
      return 0.0;
    }
  }

  std::optional<Jump> undone(const JumpSuspect& suspect, FoundJump found, double& chi2) const {
    constexpr int kRounds = 3;
    std::optional<Jump> jump;
    for (int round = 0; round < kRounds; ++round) {
      const std::vector<Touch> touches = with_undone(suspect, found);
      const Calibration c = identify_as_stated(cell_, touches, options_);
      const JumpSequence sequence(cell_, touches, c);
      const auto further = sequence.at(suspect, found.behind);
      if (!further) return {};
      const auto d = static_cast<Eigen::Index>(suspect.size);
      const Eigen::MatrixXd usual =
          Eigen::MatrixXd::Identity(d, d) + suspect.usual * suspect.usual * further->information;
      chi2 = std::max(1.0, c.chi2_per_dof);
      const Eigen::VectorXd size = found.size;
      jump.emplace();
      jump->what = suspect.what;
      jump->name = suspect.name;
      jump->after_touch = stated_.order()[found.behind - 1];
      jump->log_odds =  // (61)
          unless_field(log_evidence(cell_, touches, c) - log_evidence_ -
                           0.5 * std::log(usual.determinant()) - surprise(size, suspect.usual),
                       c);
      jump->mends = mended(c);
      const Eigen::MatrixXd covariance =  // with what is looked for: a direction may go unseen
          (further->information + Eigen::MatrixXd::Identity(d, d) / (suspect.usual * suspect.usual))
              .inverse() *
          chi2;
      jump->squared_sigmas = size.dot(further->information * size) / chi2;
      jump->sigma = std::sqrt(size.dot(covariance * size)) / size.norm();
      if (suspect.what == Jump::What::kJoint)
        jump->angle_rad = size[0];
      else
        jump->shift_m = size;
      const std::size_t placed = sequence.placed(suspect, found);
      found.size += further->size;
      found.behind = placed;
    }
    return jump;
  }

  std::optional<Jump> moved(const JumpSuspect& suspect, const FoundJump& found,
                            double& chi2) const {
    // Its last touch before.
    std::size_t last = found.behind;
    while (last > 0 && touches_[stated_.order()[last - 1]].target != suspect.name) --last;
    if (last == 0) return {};
    Jump jump;
    jump.what = Jump::What::kTarget;
    jump.name = suspect.name;
    jump.after_touch = stated_.order()[last - 1];
    const auto place = [](const Calibration& c, const std::string& id) {
      for (const TargetResult& t : c.targets)
        if (t.id == id) return t.centre_m;
      throw IdentifyError("no touches of " + id);
    };
    // First where it is then, whatever the cell file says; then as one that is within the usual of
    // there, which is what its evidence has to be compared with.
    TwoPlaces two = as_two(cell_, touches_, suspect.name, jump.after_touch);
    const Eigen::Vector3d there =
        place(identify_as_stated(two.cell, two.touches, options_), two.later);
    two = as_two(cell_, touches_, suspect.name, jump.after_touch, there, suspect.usual);
    const Calibration c = identify_as_stated(two.cell, two.touches, options_);
    jump.shift_m = place(c, two.later) - place(c, suspect.name);
    chi2 = std::max(1.0, c.chi2_per_dof);
    jump.log_odds = unless_field(log_evidence(two.cell, two.touches, c) - log_evidence_ -
                                     surprise(jump.shift_m, suspect.usual),
                                 c);
    jump.squared_sigmas = found.squared_sigmas / chi2;
    jump.sigma = found.size.norm() / std::sqrt(jump.squared_sigmas);
    jump.mends = mended(c);
    return jump;
  }

  const Cell& cell_;
  const std::vector<Touch>& touches_;
  const IdentifyOptions& options_;
  JumpSequence stated_;
  double log_evidence_;
  std::vector<std::size_t> in_order_;
  std::map<std::string, std::size_t> left_out_;  ///< touches, by target
};

}  // namespace

std::vector<Jump> jumps_by_odds(const Cell& cell, const std::vector<Touch>& touches,
                                const IdentifyOptions& options, const Calibration& calibration) {
  std::vector<Jump> jumps;
  try {
    if (touches.size() <= kMostTouches) {
      jumps = Search(cell, touches, options, calibration).all();
    } else {
      const std::vector<std::size_t> which = share_of(touches, kMostTouches);
      std::vector<Touch> share;
      for (const std::size_t i : which) share.push_back(touches[i]);
      jumps = Search(cell, share, options, identify_as_stated(cell, share, options)).all();
      for (Jump& jump : jumps) jump.after_touch = which[jump.after_touch];
    }
  } catch (const IdentifyError&) {
    return {};  // the share says too little
  }
  std::stable_sort(jumps.begin(), jumps.end(),
                   [](const Jump& a, const Jump& b) { return a.log_odds > b.log_odds; });
  return jumps;
}

std::vector<Jump> believed(std::vector<Jump> jumps) {
  std::erase_if(
      jumps, [](const Jump& j) { return j.log_odds < kBelieved || !(j.squared_sigmas > kSized); });
  if (jumps.empty()) return jumps;
  const double best = jumps.front().log_odds;
  std::erase_if(jumps, [&](const Jump& j) { return j.log_odds < best - kClear; });
  return jumps;
}

namespace {

FindingPart part_of(const Cell& cell, const std::vector<Touch>& touches, const Jump& jump) {
  FindingPart part;
  part.about = jump.what == Jump::What::kJoint ? about_joint(jump.name)
               : jump.what == Jump::What::kTool
                   ? about_tool(jump.name)
                   : about_target(cell.targets[cell.target_index(jump.name)]);
  part.about = after(part.about, jump.after_touch, touches[jump.after_touch]);
  if (jump.what == Jump::What::kJoint) {
    part.evidence = {{"turn", jump.angle_rad * kDegPerRad, "deg", jump.sigma * kDegPerRad}};
  } else {
    const Eigen::Vector3d mm = jump.shift_m * 1e3;
    part.evidence = {{"shift", mm.norm(), "mm", jump.sigma * 1e3},
                     {"x", mm.x(), "mm"},
                     {"y", mm.y(), "mm"},
                     {"z", mm.z(), "mm"}};
  }
  return part;
}

Finding finding_of(const Cell& cell, const std::vector<Touch>& touches,
                   const std::vector<Jump>& jumps) {
  Finding finding{FindingKind::kJumped, Severity::kWithholds};
  finding.evidence = {{"touches", static_cast<double>(touches.size()), ""}};
  for (const Jump& jump : jumps) finding.parts.push_back(part_of(cell, touches, jump));
  // What the same touches would look like with the foot or the tool turned.
  if (jumps.front().name == cell.robot.joints.front().name)
    finding.evidence.push_back({"first_joint", 1.0, ""});
  else if (jumps.front().name == cell.robot.joints.back().name)
    finding.evidence.push_back({"last_joint", 1.0, ""});
  return finding;
}

/// Whether it jumped, as far as touches tell without certified lengths: wrong ones pull at the arm.
bool without_lengths(const Cell& cell, const std::vector<Touch>& touches,
                     const IdentifyOptions& options, const Jump& jump) {
  if (touches.size() > kMostTouches) return true;  // they say enough of themselves
  const Cell changed = silenced(cell, [](const CertifiedLength&) { return true; });
  try {
    const Calibration c = identify_as_stated(changed, touches, options);
    return Search(changed, touches, options, c).log_odds(jump) > 0.0;
  } catch (const IdentifyError&) {
    return true;  // the touches alone determine nothing, and so do not speak against it
  }
}

}  // namespace

void tell_of_jumps(const Cell& cell, const std::vector<Touch>& touches,
                   const IdentifyOptions& options, Calibration& calibration) {
  const std::vector<Jump>& jumps = calibration.jumped;
  if (jumps.empty()) return;
  Finding finding = finding_of(cell, touches, jumps);
  if (!cell.lengths.empty() && !without_lengths(cell, touches, options, jumps.front()))
    finding.evidence.push_back({"or_lengths", 1.0, ""});
  calibration.verdict.publish = false;
  auto& findings = calibration.verdict.findings;
  // Touches on the other side of it are no gross errors.
  if (jumps.front().mends) {
    erase(findings, FindingKind::kManyOutliers);
    erase(findings, FindingKind::kOutliersOfTarget);
  }
  findings.insert(findings.begin(), std::move(finding));
}

}  // namespace cellcal::calib
