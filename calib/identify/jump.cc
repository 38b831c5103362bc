#include "calib/identify/jump.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <optional>
#include <utility>

#include "calib/estimate/discrepancy.h"
#include "calib/estimate/joint_functions.h"
#include "calib/estimate/repeats.h"
#include "calib/identify/causes.h"
#include "calib/verdict/artefacts.h"
#include "calib/verdict/session_order.h"

namespace cellcal::calib {

namespace {

/// Least gain for which an identification without the jump is tried.
constexpr double kWorthTrying = 9.0;
/// Number of touches that suffices to find jumps; all of many touches only take longer.
constexpr std::size_t kMostTouchesForJumps = 1000;
/// A discrepancy is considered if touches scatter this much more than stated (chi^2 per degree of
/// freedom), or if repeats share it.
constexpr double kAsStated = 1.5;
/// Log evidence by which a jump has to exceed another one.
constexpr double kClear = 5.0;
/// Minimum squared size of a jump over its variance, with the jump undone: if a jump of any size
/// improves the likelihood, the cause is another (touches of a target with another's name).
constexpr double kSized = 16.0;

/// Apparent creep of targets in each direction, by thermal growth of the arm of 25e-6 of its reach
/// and by play that varies during the day.
constexpr double kCreepM = 0.02e-3;

Eigen::VectorXd size_of(const Jump& jump) {
  if (jump.what == Jump::What::kJoint) return Eigen::VectorXd::Constant(1, jump.angle_rad);
  return jump.shift_m;
}

/// Log density of a jump below that of a small one: heavy tails (Student's t, three degrees of
/// freedom), since large displacements are not rare.
double size_penalty(const Eigen::VectorXd& size, double usual) {
  constexpr double kFreedom = 3.0;
  return 0.5 * (kFreedom + static_cast<double>(size.size())) *
         std::log1p(size.squaredNorm() / (kFreedom * usual * usual));
}

/// Touch by an arm without the jump: turns a joint by `size` or, for the tool, the joints so that
/// the tip is at the same position.
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
  constexpr double kDamping = 1e-4;  // [m^2], for postures with a direction of little tip motion
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

/// True if nothing else is wrong. Check touches near the jump may be on its wrong side, and one or
/// two touches near it excluded for that reason.
bool mended(const Calibration& c) {
  constexpr double kMostLeftOut = 0.1;
  constexpr double kStillTooMuch = 2.5;  // squared sigmas, with an unmodelled error of the arm
  if (c.chi2_per_dof > kStillTooMuch) return false;
  if (static_cast<double>(c.outliers.size()) > kMostLeftOut * c.before.count) return false;
  return std::ranges::all_of(c.verdict.findings, [](const Finding& one) {
    return !one.withholds() || one.kind == FindingKind::kCheckTouches ||
           one.kind == FindingKind::kManyOutliers || one.kind == FindingKind::kOutliersOfTarget;
  });
}

/// Calibration with a model discrepancy.
std::optional<Calibration> beside_model(const Cell& cell, const std::vector<Touch>& touches,
                                        IdentifyOptions options) {
  options.with_discrepancy = true;
  return tried(cell, touches, options);
}

/// True if bearings, functions or waves were found that the robot file does not state.
bool has_learnt(const Robot& stated, const Calibration& c) {
  const auto bears = [](const Joint& joint) { return joint.bearing_sigma_rad_per_nm > 0.0; };
  const Robot& found = c.cell.robot;
  return (has_functions(found) && !has_functions(stated)) ||
         (std::ranges::any_of(found.joints, bears) && std::ranges::none_of(stated.joints, bears));
}

double log_evidence_of(const std::optional<Calibration>& c) {
  return c ? c->log_evidence : -std::numeric_limits<double>::infinity();
}

/// Displacement of a target that is taken as two: from its first to its later place; of a tracker, of
/// the middle of its later readings.
struct Shift {
  Eigen::Vector3d by_m = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance_m2 = Eigen::Matrix3d::Zero();

  Shift(const Calibration& two, const std::string& target, const std::string& later) {
    const TargetResult &there = place(two, later), &here = place(two, target);
    const Eigen::Vector3d before_m = here.kind == TargetKind::kTracker
                                         ? here.frame * (there.frame.inverse() * there.centre_m)
                                         : here.centre_m;
    by_m = there.centre_m - before_m;
    Eigen::MatrixXd by = Eigen::MatrixXd::Zero(3, two.covariance.cols());
    const auto add = [&](const std::string& id, ParameterKind kind, int axis,
                         const Eigen::Vector3d& moves) {
      const ParameterResult* p = find(two, target_parameter(kind, two.cell.target_index(id), axis));
      if (p != nullptr) by.col(p - two.parameters.data()) = moves;
    };
    for (int axis = 0; axis < 3; ++axis) {
      const Eigen::Vector3d along = Eigen::Vector3d::Unit(axis);
      add(later, ParameterKind::kCentre, axis, along);
      add(target, ParameterKind::kCentre, axis, -along);
      add(target, ParameterKind::kTurn, axis, -along.cross(before_m - here.centre_m));
    }
    covariance_m2 =
        by * two.covariance * by.transpose() + kCreepM * kCreepM * Eigen::Matrix3d::Identity();
  }

  static const TargetResult& place(const Calibration& c, const std::string& id) {
    return *std::ranges::find(c.targets, id, &TargetResult::id);
  }
  double squared_sigmas() const { return by_m.dot(covariance_m2.ldlt().solve(by_m)); }  // (60)
  double sigma_m() const { return std::sqrt(by_m.dot(covariance_m2 * by_m)) / by_m.norm(); }
};

/// The session with one jump undone.
struct Undone {
  Jump jump;
  Cell cell;
  std::vector<Touch> touches;
  std::string later;  ///< id of the second target, if a target is taken as two
  double log_evidence = 0.0;
  double penalty = 0.0;  ///< for the size of the jump
  double chi2 = 1.0;     ///< per degree of freedom, at least 1
  bool alike = false;    ///< residuals of similar postures are still correlated
};

/// Search for jumps in one session.
class JumpSearch {
 public:
  JumpSearch(const Cell& cell, const std::vector<Touch>& touches, const IdentifyOptions& options,
             const Calibration& calibration)
      : cell_(cell),
        touches_(touches),
        options_(options),
        calibration_(calibration),
        learnt_(has_learnt(cell.robot, calibration) &&
                of_one_tool_per_posture(touches).size() == touches.size()),
        log_evidence_(learnt_ ? log_evidence_of(tried(cell, touches, options))
                              : calibration.log_evidence) {
    for (const Outlier& o : calibration.outliers) ++left_out_[touches[o.touch].target];
    for (const MovedTarget& m : calibration.moved) left_out_[m.target] += touches.size();
  }

  /// Log odds of a known jump.
  double log_odds(const Jump& known) const {
    const auto& order = stated().order();
    const auto suspect = std::ranges::find_if(stated().suspects(), [&](const JumpSuspect& one) {
      return one.what == known.what && one.name == known.name;
    });
    const auto last = std::ranges::find(order, known.after_touch);
    if (suspect == stated().suspects().end() || order.end() - last < 2) return 0.0;
    FoundJump found;
    found.behind = static_cast<std::size_t>(last - order.begin()) + 1;
    found.size = size_of(known);
    const auto one = without(*suspect, found);
    return one ? one->jump.log_odds / one->chi2 : 0.0;
  }

  std::vector<Jump> all() {
    std::vector<Undone> all;
    double scatter = 1.0, always = 0.0;
    double best = -std::numeric_limits<double>::infinity();
    for (const JumpSuspect& suspect : stated().suspects()) {
      const bool is_target = suspect.what == Jump::What::kTarget;
      if (is_target && !needs_inspection(suspect.name)) continue;
      const auto found = stated().robust(suspect);
      if (!found || found->squared_sigmas < kWorthTrying) continue;
      std::optional<Undone> one = without(suspect, *found);
      if (!one) continue;  // too few touches on one side
      if (!is_target && one->jump.log_odds > kConfirmedOdds)
        always = std::max(always, log_odds_of_always(suspect, one->jump));
      if (one->jump.log_odds > best) {
        best = one->jump.log_odds;
        scatter = one->chi2;
      }
      all.push_back(std::move(*one));
    }
    // Scatter above the stated noise reduces the weight of the touches.
    const double places = std::log(static_cast<double>(stated().order().size()));
    for (Undone& one : all)
      one.jump.log_odds = (one.jump.log_odds - always) / scatter - places;  // (62)
    std::ranges::stable_sort(all, std::greater<>(),
                             [](const Undone& one) { return one.jump.log_odds; });
    std::vector<Jump> jumps;
    for (Undone& one : all) {
      test_against_model(one, places);
      jumps.push_back(one.jump);
    }
    return jumps;
  }

  /// Jump of a target after a known touch, without penalty for the search.
  std::optional<Jump> move(const std::string& target, std::size_t after_touch) {
    std::optional<Undone> one = split_in_two(target, after_touch);
    if (!one) return {};
    one->jump.log_odds /= one->chi2;
    test_against_model(*one, 0.0);
    return one->jump;
  }

 private:
  /// Limits the log odds by comparison with a model discrepancy, if the arm may have one. `places`:
  /// penalty for the search of the place.
  void test_against_model(Undone& one, double places) {
    if (one.jump.log_odds < kConfirmedOdds) return;
    if (!learnt_ && !one.alike && one.chi2 < kAsStated && calibration_.repeats.touches == 0) return;
    if (!beside_)
      beside_ = std::max(calibration_.log_evidence,
                         log_evidence_of(beside_model(cell_, touches_, options_)));
    const std::optional<Calibration> c = beside_model(one.cell, one.touches, options_);
    one.jump.mends = one.jump.mends || (c && mended(*c));
    double undone = std::max(one.log_evidence, log_evidence_of(c));
    if (learnt_)
      undone = std::max(undone, log_evidence_of(tried(one.cell, one.touches, options_, true)));
    one.jump.log_odds =
        std::min(one.jump.log_odds, undone - *beside_ - one.penalty - places);  // (62a)
    if (c && one.jump.what == Jump::What::kTarget)
      measure(Shift(*c, one.jump.name, one.later), one.jump);
  }

  /// Sequence of all touches, linearised at the fullest level alone; created on first use.
  const JumpSequence& stated() const {
    if (!stated_) stated_.emplace(cell_, touches_, calibration_);
    return *stated_;
  }

  static void measure(const Shift& shift, Jump& jump) {
    jump.shift_m = shift.by_m;
    jump.sigma = shift.sigma_m();
    jump.squared_sigmas = shift.squared_sigmas();
  }

  /// True for all of a few targets; of many, for those with the most excluded touches.
  bool needs_inspection(const std::string& target) const {
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
    for (const std::size_t i : in_order(touches_)) {
      passed = passed || i == stated().order()[found.behind];
      if (passed) undo(stated().problem().arm(), suspect, found.size, touches[i]);
    }
    return touches;
  }

  std::optional<Undone> without(const JumpSuspect& suspect, const FoundJump& found) const {
    return suspect.what == Jump::What::kTarget ? moved(suspect, found) : undone(suspect, found);
  }

  /// Log odds of an error throughout the session, a wrong mastering or another tool, which a jump
  /// after the first few touches explains as well, at the cost of these.
  double log_odds_of_always(const JumpSuspect& suspect, const Jump& jump) const {
    FoundJump always;
    always.size = size_of(jump);
    const std::vector<Touch> touches = with_undone(suspect, always);
    const std::optional<Calibration> c = tried(cell_, touches, options_);
    return c ? c->log_evidence - log_evidence_ - size_penalty(always.size, suspect.usual) : 0.0;
  }

  std::optional<Undone> undone(const JumpSuspect& suspect, FoundJump found) const {
    constexpr int kRounds = 3;
    Undone one;
    one.cell = cell_;
    one.jump = {suspect.what, suspect.name};
    for (int round = 0; round < kRounds; ++round) {
      one.touches = with_undone(suspect, found);
      const std::optional<Calibration> c = tried(cell_, one.touches, options_);
      if (!c) return {};
      const JumpSequence sequence(cell_, one.touches, *c);
      const auto further = sequence.at(suspect, found.behind);
      if (!further) return {};
      const auto d = static_cast<Eigen::Index>(suspect.size);
      const Eigen::MatrixXd usual =
          Eigen::MatrixXd::Identity(d, d) + suspect.usual * suspect.usual * further->information;
      const Eigen::VectorXd size = found.size;
      one.penalty =  // (61)
          0.5 * std::log(usual.determinant()) + size_penalty(size, suspect.usual);
      weigh(*c, one);
      one.jump.after_touch = stated().order()[found.behind - 1];
      const Eigen::MatrixXd covariance =  // with the size's prior: a direction may be unseen
          (further->information + Eigen::MatrixXd::Identity(d, d) / (suspect.usual * suspect.usual))
              .inverse() *
          one.chi2;
      one.jump.squared_sigmas = size.dot(further->information * size) / one.chi2;
      one.jump.sigma = std::sqrt(size.dot(covariance * size)) / size.norm();
      if (suspect.what == Jump::What::kJoint)
        one.jump.angle_rad = size[0];
      else
        one.jump.shift_m = size;
      const std::size_t placed = sequence.placed(suspect, found);
      found.size += further->size;
      found.behind = placed;
    }
    return one;
  }

  std::optional<Undone> moved(const JumpSuspect& suspect, const FoundJump& found) const {
    // Last touch of the target before the jump.
    std::size_t last = found.behind;
    while (last > 0 && touches_[stated().order()[last - 1]].target != suspect.name) --last;
    if (last == 0) return {};
    return split_in_two(suspect.name, stated().order()[last - 1]);
  }

  std::optional<Undone> split_in_two(const std::string& target, std::size_t after_touch) const {
    // First with a free later position, regardless of the cell file; then with the usual
    // displacement about it as prior, with which its evidence is comparable.
    TwoPlaces two = as_two(cell_, touches_, target, after_touch);
    const std::optional<Calibration> free = tried(two.cell, two.touches, options_);
    if (!free) return {};
    const Eigen::Vector3d there = Shift::place(*free, two.later).centre_m;
    two = as_two(cell_, touches_, target, after_touch, there, kUsualKnockM);
    const std::optional<Calibration> c = tried(two.cell, two.touches, options_);
    if (!c) return {};
    Undone one;
    one.jump = {Jump::What::kTarget, target, after_touch};
    measure(Shift(*c, target, two.later), one.jump);
    one.penalty = size_penalty(one.jump.shift_m, kUsualKnockM);
    weigh(*c, one);
    one.cell = std::move(two.cell);
    one.touches = std::move(two.touches);
    one.later = std::move(two.later);
    return one;
  }

  void weigh(const Calibration& c, Undone& one) const {
    one.chi2 = std::max(1.0, c.chi2_per_dof);
    one.alike = c.discrepancy.alike > kFieldSigmas;
    one.log_evidence = c.log_evidence;
    one.jump.log_odds = c.log_evidence - log_evidence_ - one.penalty;
    one.jump.mends = mended(c);
  }

  const Cell& cell_;
  const std::vector<Touch>& touches_;
  const IdentifyOptions& options_;
  const Calibration& calibration_;
  /// The calibration has parts that hypotheses are tested without. Not counted where several tools are read at one
  /// posture: these share its errors, and a jump would be found in them.
  bool learnt_;
  double log_evidence_;  ///< without a jump and without those
  mutable std::optional<JumpSequence> stated_;
  std::optional<double> beside_;                 ///< log evidence without a jump, (62a)
  std::map<std::string, std::size_t> left_out_;  ///< number of excluded touches, by target
};

/// Displacement of the tip by the jump [m], rms over the touches.
double at_the_tip_m(const Cell& cell, const std::vector<Touch>& touches, const Jump& jump) {
  if (jump.what != Jump::What::kJoint) return jump.shift_m.norm();
  const ArmModel arm(cell);
  const auto joint = std::ranges::find(cell.robot.joints, jump.name, &Joint::name);
  const auto column = joint - cell.robot.joints.begin();
  double square_m2 = 0.0;
  for (const Touch& touch : touches)
    square_m2 += arm.nominal_jacobian(touch.joint_rad).col(column).head<3>().squaredNorm();
  return std::abs(jump.angle_rad) * std::sqrt(square_m2 / static_cast<double>(touches.size()));
}

/// True for a jump that is significant and displaces the tip by more than `covered_m`.
bool confirmed(const Cell& cell, const std::vector<Touch>& touches, double covered_m,
               const Jump& jump) {
  return jump.log_odds > kConfirmedOdds && jump.squared_sigmas > kSized &&
         at_the_tip_m(cell, touches, jump) > covered_m;
}

FindingPart part_of(const Cell& cell, const std::vector<Touch>& touches, const Jump& jump) {
  FindingPart part;
  part.about = jump.what == Jump::What::kJoint ? about_joint(jump.name)
               : jump.what == Jump::What::kTool
                   ? about_tool(jump.name)
                   : about_target(cell.targets[cell.target_index(jump.name)]);
  part.about = after(part.about, jump.after_touch, touches[jump.after_touch]);
  if (jump.what == Jump::What::kJoint)
    part.evidence = {in_deg("turn", jump.angle_rad, jump.sigma)};
  else
    part.evidence = shift_in_mm(jump.shift_m, jump.sigma);
  add_rank(touches, jump.after_touch, part.evidence);
  return part;
}

Finding finding_of(const Cell& cell, const std::vector<Touch>& touches,
                   const std::vector<Jump>& jumps) {
  Finding finding{FindingKind::kJumped, Severity::kWithholds};
  finding.evidence = {{"touches", static_cast<double>(touches.size()), ""}};
  for (const Jump& jump : jumps) finding.parts.push_back(part_of(cell, touches, jump));
  // A first or last joint resembles a turned foot or tool. Only for joints: a target may have the
  // name of a joint.
  const Jump& likeliest = jumps.front();
  if (likeliest.what != Jump::What::kJoint) return finding;
  if (likeliest.name == cell.robot.joints[cell.robot.first_turning()].name)
    finding.evidence.push_back({"first_joint", 1.0, ""});
  else if (likeliest.name == cell.robot.joints.back().name)
    finding.evidence.push_back({"last_joint", 1.0, ""});
  return finding;
}

/// True if the touches show the jump without certified lengths, since wrong lengths distort the
/// arm.
bool without_lengths(const Cell& cell, const std::vector<Touch>& touches,
                     const IdentifyOptions& options, const Jump& jump) {
  if (touches.size() > kMostTouchesForJumps) return true;  // lengths weigh little in so many
  const Cell changed = silenced(cell);
  const std::optional<Calibration> c = tried(changed, touches, options);
  if (!c) return true;  // the touches alone determine nothing and so do not contradict it
  return JumpSearch(changed, touches, options, *c).log_odds(jump) > 0.0;
}

}  // namespace

std::vector<Jump> jumps_by_odds(const Cell& cell, const std::vector<Touch>& touches,
                                const IdentifyOptions& options, const Calibration& calibration) {
  std::vector<Jump> jumps;
  if (touches.size() <= kMostTouchesForJumps) {
    jumps = JumpSearch(cell, touches, options, calibration).all();
  } else {
    const std::vector<std::size_t> which = share_of(touches, kMostTouchesForJumps);
    std::vector<Touch> share;
    for (const std::size_t i : which) share.push_back(touches[i]);
    const std::optional<Calibration> c =
        tried(cell, share, options, has_learnt(cell.robot, calibration));
    if (!c) return {};  // the subset determines too little
    jumps = JumpSearch(cell, share, options, *c).all();
    for (Jump& jump : jumps) jump.after_touch = which[jump.after_touch];
  }
  std::ranges::stable_sort(jumps, std::greater<>(), &Jump::log_odds);
  return jumps;
}

double log_evidence_with_model(const Cell& cell, const std::vector<Touch>& touches,
                               const IdentifyOptions& options) {
  return std::max(log_evidence_of(beside_model(cell, touches, options)),
                  log_evidence_of(tried(cell, touches, options)));
}

double covered_m(const Calibration& calibration) {
  return calibration.verdict.publish() ? calibration.predicted_near_targets_m : 0.0;
}

std::vector<Jump> confirmed_jumps(const Cell& cell, const std::vector<Touch>& touches,
                                  double covered_m, std::vector<Jump> jumps) {
  std::erase_if(jumps, [&](const Jump& j) { return !confirmed(cell, touches, covered_m, j); });
  const double best = jumps.empty() ? 0.0 : jumps.front().log_odds;
  std::erase_if(jumps, [&](const Jump& j) { return j.log_odds < best - kClear; });
  return jumps;
}

void withhold_for_jumps(const Cell& cell, const std::vector<Touch>& touches,
                        const IdentifyOptions& options, Calibration& calibration) {
  const std::vector<Jump>& jumps = calibration.jumped;
  if (jumps.empty()) return;
  Finding finding = finding_of(cell, touches, jumps);
  if (!cell.lengths.empty() && !without_lengths(cell, touches, options, jumps.front()))
    finding.evidence.push_back({"or_lengths", 1.0, ""});
  auto& findings = calibration.verdict.findings;
  // Touches on the other side of the jump are no gross errors.
  if (jumps.front().mends) {
    erase(findings, FindingKind::kManyOutliers);
    erase(findings, FindingKind::kOutliersOfTarget);
  }
  calibration.verdict.add_first(std::move(finding));
}

void confirm_moves(const Cell& cell, const std::vector<Touch>& touches,
                   const IdentifyOptions& options, double covered_m, Calibration& calibration) {
  JumpSearch search(cell, touches, options, calibration);
  std::optional<Jump> likeliest;
  for (const MovedTarget& suspect : calibration.moved) {
    const auto move = search.move(suspect.target, suspect.after_touch);
    if (move && confirmed(cell, touches, covered_m, *move) &&
        (!likeliest || move->log_odds > likeliest->log_odds))
      likeliest = move;
  }
  calibration.moved.clear();
  if (likeliest) withhold_for_move(cell, touches, *likeliest, calibration);
}

void withhold_for_move(const Cell& cell, const std::vector<Touch>& touches, const Jump& move,
                       Calibration& calibration) {
  calibration.moved = {
      {move.name, move.after_touch, move.shift_m, move.sigma, move.squared_sigmas}};
  FindingPart part = part_of(cell, touches, move);
  calibration.verdict.add_first({FindingKind::kMovedTarget, Severity::kWithholds,
                                 std::move(part.about), std::move(part.evidence)});
}

}  // namespace cellcal::calib
