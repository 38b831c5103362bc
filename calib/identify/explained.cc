#include "calib/identify/explained.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "calib/model/error.h"
#include "calib/model/units.h"

namespace cellcal::calib {

namespace {

std::optional<Eigen::Index> row_of(const Calibration& c, const ParameterKey& key) {
  const auto found = std::ranges::find(c.parameters, key, &ParameterResult::key);
  if (found == c.parameters.end()) return std::nullopt;
  return found - c.parameters.begin();
}

/// Prior probability of no change: an update has a reason.
constexpr double kNothingBefore = 0.5;
/// Prior share of erroneous touches, although confirmed.
constexpr double kWrongTouch = 0.01;
/// Prior odds of a second change, given one.
constexpr double kSecondBefore = 0.1;

bool same(const PossibleChange& a, const PossibleChange& b) {
  return a.kind == b.kind && a.name == b.name && a.index == b.index;
}

/// Log prior probability of this change with this size.
double log_before(const Weighed& one) {
  return std::log(one.change.weight / static_cast<double>(one.change.usual.size()));
}

Explanation explanation_of(const Weighed& one) {
  Explanation e;
  e.kind = one.change.kind;
  e.name = one.change.name;
  e.touch = e.kind == ChangeKind::kTouch ? one.change.index : 0;
  put_size(one.how.size, one.how.size_covariance, e);
  return e;
}

/// Probability of a larger chi^2, by the cube root's normal approximation (Wilson and Hilferty
/// 1931).
double chance_of(double chi2, double dof) {
  if (!(dof > 0.0)) return 1.0;
  const double h = 2.0 / (9.0 * dof);
  const double z = (std::cbrt(chi2 / dof) - (1.0 - h)) / std::sqrt(h);
  return normal_above(z);
}

/// Second change in addition to that of an explanation.
struct Beside {
  Cholesky information;  ///< on its size
  Eigen::VectorXd size;
  double log_ratio = 0.0;  ///< log likelihood ratio with and without it
};

/// Linearised at the result of the first change, whose whitened residuals are `off`.
Beside beside(const Weighed& first, const Eigen::VectorXd& off, const Weighed& other) {
  Eigen::MatrixXd by = first.how.rows * other.moves;
  if (other.change.kind == ChangeKind::kTouch)
    by(static_cast<Eigen::Index>(other.change.index), 0) = -1.0;
  by = first.how.foreseen.whitened(by);
  const double variance = other.usual * other.usual;
  Eigen::MatrixXd information = by.transpose() * by;
  information.diagonal().array() += 1.0 / variance;
  const Eigen::VectorXd pull = by.transpose() * off;
  Beside result{Cholesky(information), {}, 0.0};
  result.size = result.information.solve(pull);
  result.log_ratio = 0.5 * (pull.dot(result.size) - result.information.log_det() -
                            static_cast<double>(other.change.size) * std::log(variance));  // (82)
  return result;
}

bool may_be_beside(const Weighed& other, const Weighed& first) {
  return other.change.size > 0 && !same(other.change, first.change);
}

/// Prior sigma of a tip that the cell file states as known, the largest change searched for.
constexpr double kOpenTipM = 15e-3;
/// Lengths of an arm below this count as zero.
constexpr double kNoLengthM = 1e-4;

void open_tip(Calibration& c) {
  for (int axis = 0; axis < 3; ++axis) {
    const ParameterKey key = tool_parameter(ParameterKind::kTcp, 0, axis);
    if (row_of(c, key)) continue;
    c.cell.tool.tcp_sigma_m[axis] = kOpenTipM;
    c.parameters.push_back({key, "mm", kMmPerM});
  }
  const auto had = c.covariance.rows(), has = static_cast<Eigen::Index>(c.parameters.size());
  c.covariance.conservativeResizeLike(Eigen::MatrixXd::Zero(has, has));
  if (c.frame_basis.rows() == had)
    c.frame_basis.conservativeResizeLike(Eigen::MatrixXd::Zero(has, c.frame_basis.cols()));
}

/// Drift per month without intervention, 1 sigma; it grows with the root of the time. Of each joint's zero
/// (belts, bearings), each component of the tool's tip (wear, its seat) and of a sphere's centre (posts,
/// glue), of the place and direction of a positioner's axis (its foot, bearings).
double per_root_month(const ParameterKey& key) {
  constexpr double kTurnsRad = 5e-6, kMovesM = 10e-6;
  const AxisError error{key.kind == ParameterKind::kPositioner ? key.axis : 0};
  switch (key.kind) {
    case ParameterKind::kTheta: return kTurnsRad;
    case ParameterKind::kTcp: return key.tool == 0 ? kMovesM : 0.0;
    case ParameterKind::kCentre: return kMovesM;
    case ParameterKind::kPositioner:
      if (error == AxisError::kX || error == AxisError::kY) return kMovesM;
      return error == AxisError::kTurnX || error == AxisError::kTurnY ? kTurnsRad : 0.0;
    default: return 0.0;
  }
}

/// Sets one entry of a column; false if the parameter does not exist.
bool set(Eigen::MatrixXd& columns, Eigen::Index column, const Calibration& c,
         const ParameterKey& key, double value) {
  const auto row = row_of(c, key);
  if (row) columns(*row, column) = value;
  return row.has_value();
}

/// Small motions of what a positioner carries, as changes of the parameters: an axis has no error along
/// itself nor about itself, so that these move what it carries. A column of the parameters each.
class CarriedMotion {
 public:
  CarriedMotion(const Calibration& c, Eigen::MatrixXd& columns, Eigen::Index column)
      : c_(c), columns_(columns), column_(column) {}

  /// Shift of the origin and turn of the frame that the first `carriers` axes carry, in that frame. False if the
  /// calibration lacks a parameter for it.
  bool carried(std::size_t carriers, const Eigen::Vector3d& shift, const Eigen::Vector3d& about) {
    for (const TargetResult& target : c_.targets) {
      const std::size_t t = c_.cell.target_index(target.id);
      if (c_.cell.targets[t].carried_by != static_cast<int>(carriers)) continue;
      const Eigen::Vector3d by = shift + about.cross(target.centre_m);
      for (int axis = 0; axis < 3; ++axis)
        if (!put(target_parameter(ParameterKind::kCentre, t, axis), by[axis])) return false;
    }
    return carriers == c_.cell.robot.positioner.size() || stands(carriers, shift, about);
  }
  /// Likewise of the frame that carries an axis, the base frame for the first.
  bool stands(std::size_t axis, const Eigen::Vector3d& shift, const Eigen::Vector3d& about) {
    const Eigen::Isometry3d& frame = c_.cell.robot.positioner[axis].frame;
    const Eigen::Matrix3d into = frame.linear().transpose();
    const Eigen::Vector3d by = into * (shift + about.cross(frame.translation())),
                          turn = into * about;
    const auto error = [&](AxisError one) { return positioner_parameter(axis, one); };
    return put(error(AxisError::kX), by.x()) && put(error(AxisError::kY), by.y()) &&
           put(error(AxisError::kTurnX), turn.x()) && put(error(AxisError::kTurnY), turn.y()) &&
           carried(axis + 1, by.z() * Eigen::Vector3d::UnitZ(),
                   turn.z() * Eigen::Vector3d::UnitZ());
  }

 private:
  bool put(const ParameterKey& key, double value) {
    constexpr double kNothing = 1e-9;
    return set(columns_, column_, c_, key, value) || std::abs(value) < kNothing;
  }

  const Calibration& c_;
  Eigen::MatrixXd& columns_;
  Eigen::Index column_;
};

/// By each component of a motion of the positioner's foot: shift of its first axis, and turn, base frame.
bool fill_foot(const Calibration& c, Eigen::MatrixXd& columns) {
  const Eigen::Vector3d at = c.cell.robot.positioner.front().frame.translation();
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Vector3d along = Eigen::Vector3d::Unit(axis), none = Eigen::Vector3d::Zero();
    if (!CarriedMotion(c, columns, axis).stands(0, along, none) ||
        !CarriedMotion(c, columns, axis + 3).stands(0, at.cross(along), along))
      return false;
  }
  return true;
}

/// By the zero of a joint, or of a positioner's axis.
bool fill_zero(const Calibration& c, std::size_t index, Eigen::MatrixXd& columns) {
  const std::vector<Joint>& joints = c.cell.robot.joints;
  if (index < joints.size())
    return set(columns, 0, c, joint_parameter(ParameterKind::kTheta, index), joints[index].sign);
  const std::size_t axis = index - joints.size();
  return CarriedMotion(c, columns, 0)
      .carried(axis + 1, Eigen::Vector3d::Zero(),
               c.cell.robot.positioner[axis].sign * Eigen::Vector3d::UnitZ());
}

bool fill(const PossibleChange& change, const Calibration& c, Eigen::MatrixXd& columns) {
  switch (change.kind) {
    case ChangeKind::kNothing:
    case ChangeKind::kTouch: return true;
    case ChangeKind::kTool:
      for (int axis = 0; axis < 3; ++axis)
        if (!set(columns, axis, c, tool_parameter(ParameterKind::kTcp, 0, axis), 1.0)) return false;
      return true;
    case ChangeKind::kSphere:
      for (int axis = 0; axis < 3; ++axis) {
        const std::size_t target = c.cell.target_index(change.name);
        if (!set(columns, axis, c, target_parameter(ParameterKind::kCentre, target, axis), 1.0))
          return false;
      }
      return true;
    case ChangeKind::kJoint: return fill_zero(c, change.index, columns);
    case ChangeKind::kPositioner: return fill_foot(c, columns);
    case ChangeKind::kGrowth:
      for (std::size_t i = 0; i < c.cell.robot.joints.size(); ++i) {
        const Joint& joint = c.cell.robot.joints[i];
        const auto grows = [&](ParameterKind kind, double length_m) {
          return set(columns, 0, c, joint_parameter(kind, i), length_m) ||
                 std::abs(length_m) < kNoLengthM;
        };
        if (!grows(ParameterKind::kD, joint.d_m) || !grows(ParameterKind::kA, joint.a_m))
          return false;
      }
      return true;
  }
  return false;
}

}  // namespace

TouchEquations::TouchEquations(const Calibration& prior, const std::vector<Touch>& touches)
    : known_(prior, touches), parameters_(static_cast<Eigen::Index>(prior.parameters.size())) {
  const Foresight foresight = foresee(prior, touches);
  contacts_ = foresight.contacts;
  noise_m2_ = foresight.model_error_m2 + foresight.passing_m2;
  std::vector<double> values, variances;
  for (const ParameterResult& one : prior.parameters)
    values.push_back(one.nominal + one.correction);
  for (const Unknown& unknown : known_.unknowns()) {
    const auto place = row_of(prior, unknown.key);
    const bool asked = !place && unknown.key.kind == ParameterKind::kLatchDelay;
    place_.push_back(place ? *place : asked ? static_cast<Eigen::Index>(values.size()) : -1);
    if (!asked) continue;
    values.push_back(unknown.nominal);
    variances.push_back(unknown.scale * unknown.scale);
  }
  const auto all = static_cast<Eigen::Index>(values.size());
  x_ = Eigen::Map<const Eigen::VectorXd>(values.data(), all);
  covariance_ = Eigen::MatrixXd::Zero(all, all);
  covariance_.topLeftCorner(parameters_, parameters_) = prior.covariance;
  for (std::size_t k = 0; k < variances.size(); ++k) {
    const Eigen::Index at = parameters_ + static_cast<Eigen::Index>(k);
    covariance_(at, at) = variances[k];
  }
  sigma_m_ = noise_m2_.diagonal().cwiseSqrt();
}

void TouchEquations::set_aside(std::size_t touch) {
  constexpr double kAnywhereM = 1.0;
  const auto k = static_cast<Eigen::Index>(touch);
  noise_m2_.row(k).setZero();
  noise_m2_.col(k).setZero();
  noise_m2_(k, k) = kAnywhereM * kAnywhereM;
}

Eigen::VectorXd TouchEquations::in_problem(const Eigen::VectorXd& x) const {
  Eigen::VectorXd of_problem = known_.x();
  for (std::size_t i = 0; i < place_.size(); ++i)
    if (place_[i] >= 0) of_problem[static_cast<Eigen::Index>(i)] = x[place_[i]];
  return of_problem;
}

Eigen::VectorXd TouchEquations::off_m(const Eigen::VectorXd& x) const {
  return known_.off_m(in_problem(x));
}

Eigen::MatrixXd TouchEquations::rows(const Eigen::VectorXd& x) const {
  const KnownTouches::RowMajor of_problem = known_.rows(in_problem(x));
  Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(of_problem.rows(), x_.size());
  for (std::size_t i = 0; i < place_.size(); ++i)
    if (place_[i] >= 0) rows.col(place_[i]) = of_problem.col(static_cast<Eigen::Index>(i));
  return rows;
}

Eigen::MatrixXd Explained::covariance(const Eigen::MatrixXd& beforehand) const {
  const Eigen::MatrixXd whitened = foreseen.whitened(Eigen::MatrixXd(across_m.transpose()));
  return beforehand - whitened.transpose() * whitened;  // (79)
}

Explained explained(const TouchEquations& touches, const PossibleChange& change,
                    const Eigen::MatrixXd& moves, double usual) {
  // With a shift of millimetres on a sphere of tens each step leaves a tenth or less.
  constexpr int kSteps = 12;
  constexpr double kSettledM = 1e-9;
  Explained e;
  e.x = touches.x();
  const double variance = usual * usual;
  Eigen::MatrixXd by_size;
  for (int k = 0; k < kSteps; ++k) {
    e.rows = touches.rows(e.x);
    by_size = e.rows * moves;
    if (change.kind == ChangeKind::kTouch)
      by_size(static_cast<Eigen::Index>(change.index), 0) = -1.0;
    e.off_m = e.rows * (e.x - touches.x()) - touches.off_m(e.x);  // (77)
    const Eigen::MatrixXd through = touches.covariance() * e.rows.transpose();
    Eigen::MatrixXd v =
        e.rows * through + touches.noise_m2() + variance * by_size * by_size.transpose();
    v = (0.5 * (v + v.transpose())).eval();
    e.foreseen = Cholesky(v);  // (76)
    e.across_m = through + variance * moves * by_size.transpose();
    const Eigen::VectorXd next = touches.x() + e.across_m * e.foreseen.solve(e.off_m);  // (78)
    const double step_m = (e.rows * (next - e.x)).cwiseAbs().maxCoeff();
    e.x = next;
    if (step_m < kSettledM) break;
  }
  const Eigen::MatrixXd whitened = e.foreseen.whitened(by_size);
  e.size = variance * whitened.transpose() * e.foreseen.whitened(e.off_m);
  e.size_covariance = variance * Eigen::MatrixXd::Identity(change.size, change.size) -
                      variance * variance * whitened.transpose() * whitened;
  e.log_evidence = -0.5 * (e.chi2() + e.foreseen.log_det());
  return e;
}

std::vector<Weighed> weighed(const Calibration& prior, const TouchEquations& touches) {
  std::vector<PossibleChange> changes = possible_changes(prior, touches.contacts());
  for (PossibleChange& change : changes) change.weight *= 1.0 - kNothingBefore;
  changes.insert(changes.begin(),
                 {ChangeKind::kNothing, "", 0, 0, kNothingBefore, std::vector<double>{1.0}});
  std::vector<Weighed> all;
  std::vector<double> logs;
  for (const PossibleChange& change : changes) {
    const auto of_parameters = moved_by(change, prior);
    if (!of_parameters) continue;
    Eigen::MatrixXd moves = Eigen::MatrixXd::Zero(touches.x().size(), change.size);
    moves.topRows(touches.parameters()) = *of_parameters;
    for (const double usual : change.usual) {
      all.push_back({change, moves, usual, explained(touches, change, moves, usual)});
      logs.push_back(all.back().how.log_evidence + log_before(all.back()));
    }
  }
  for (std::size_t k = 0; k < all.size(); ++k)
    all[k].probability = std::exp(logs[k] - log_sum(logs));
  return all;  // (80)
}

std::vector<Explanation> explanations(const std::vector<Weighed>& all) {
  std::vector<Explanation> list;
  for (std::size_t k = 0; k < all.size();) {
    const std::size_t first = k;
    std::size_t best = k;
    double probability = 0.0;
    std::vector<double> logs;
    for (; k < all.size() && same(all[k].change, all[first].change); ++k) {
      probability += all[k].probability;
      logs.push_back(all[k].how.log_evidence);
      if (all[k].probability > all[best].probability) best = k;
    }
    list.push_back(explanation_of(all[best]));
    list.back().probability = probability;
    list.back().log_likelihood = log_sum(logs) - std::log(static_cast<double>(logs.size())) -
                                 all.front().how.log_evidence;  // relative to no change
  }
  std::ranges::stable_sort(list, std::greater{}, &Explanation::probability);
  return list;
}

const Weighed& likeliest(const std::vector<Weighed>& all) {
  const Explanation first = explanations(all).front();
  const Weighed* best = nullptr;
  for (const Weighed& one : all) {
    const bool of_it = one.change.kind == first.kind && one.change.name == first.name &&
                       (first.kind != ChangeKind::kTouch || one.change.index == first.touch);
    if (of_it && (best == nullptr || one.probability > best->probability)) best = &one;
  }
  return *best;
}

Sufficient sufficient(const Weighed& one, const std::vector<Weighed>& all,
                      std::size_t touches_set_aside) {
  Sufficient result;
  result.chi2 = one.how.chi2();
  result.degrees_of_freedom = static_cast<double>(one.how.off_m.size() - one.change.size) -
                              static_cast<double>(touches_set_aside);
  result.by_chance = chance_of(result.chi2, result.degrees_of_freedom);  // (81)
  const Eigen::VectorXd off = one.how.foreseen.whitened(one.how.off_m);
  std::vector<double> logs;
  double best = -std::numeric_limits<double>::infinity();
  for (const Weighed& other : all) {
    if (!may_be_beside(other, one)) continue;
    const Beside more = beside(one, off, other);
    logs.push_back(more.log_ratio + std::log(kSecondBefore) + log_before(other));
    if (logs.back() <= best) continue;
    best = logs.back();
    Weighed second{other.change, {}, other.usual, {}};
    second.how.size = more.size;
    second.how.size_covariance = more.information.inverse();
    result.second = explanation_of(second);
  }
  result.log_odds_more = log_sum(logs);
  return result;
}

OneOrTwo one_or_two(const std::vector<Weighed>& all) {
  std::vector<double> one, with_touch, two;
  for (const Weighed& first : all) {
    const double log_first = first.how.log_evidence + log_before(first);
    one.push_back(log_first);
    if (first.change.size == 0 || first.change.kind == ChangeKind::kTouch) continue;
    const Eigen::VectorXd off = first.how.foreseen.whitened(first.how.off_m);
    for (const Weighed& other : all) {
      if (!may_be_beside(other, first)) continue;
      const double log_pair = log_first + beside(first, off, other).log_ratio;
      if (other.change.kind == ChangeKind::kTouch)
        with_touch.push_back(
            log_pair + std::log(kWrongTouch / static_cast<double>(other.change.usual.size())));
      else
        two.push_back(log_pair + std::log(kSecondBefore) + log_before(other));
    }
  }
  return {log_sum(one), log_sum(with_touch), log_sum(two)};
}

double log_wrong(const std::vector<Weighed>& all, std::size_t touch) {
  const auto t = static_cast<Eigen::Index>(touch);
  const auto as_wrong = std::ranges::find_if(
      all, [](const Weighed& one) { return one.change.kind == ChangeKind::kTouch; });
  const std::vector<double>& usual = as_wrong->change.usual;
  std::vector<double> with, without;
  for (const Weighed& one : all) {
    if (one.change.kind == ChangeKind::kTouch) continue;
    // Residual of this touch predicted from the others, and its variance.
    const Eigen::MatrixXd information = one.how.foreseen.inverse();
    const double variance = 1.0 / information(t, t);
    const double off = information.row(t).dot(one.how.off_m) * variance;
    const auto log_density = [&](double wide) {
      return -0.5 * (off * off / wide + std::log(wide));
    };
    without.push_back(one.how.log_evidence + log_before(one) - log_density(variance));
    for (const double size : usual)
      with.push_back(without.back() + log_density(variance + size * size) -
                     std::log(static_cast<double>(usual.size())));
  }
  return std::log(kWrongTouch) + log_sum(with) - log_sum(without);  // (85)
}

std::optional<std::size_t> doubtful_touch(const std::vector<Weighed>& all,
                                          const std::vector<bool>& may_be) {
  std::optional<std::size_t> doubtful;
  double best = -std::numeric_limits<double>::infinity();
  for (const Weighed& one : all) {
    if (one.change.kind == ChangeKind::kTouch) continue;
    const Eigen::MatrixXd information = one.how.foreseen.inverse();
    const Eigen::VectorXd pull = information * one.how.off_m;
    const double log_alone = one.how.log_evidence + log_before(one);
    for (Eigen::Index t = 0; t < pull.size(); ++t) {
      if (!may_be[static_cast<std::size_t>(t)]) continue;
      // As (82), for an erroneous touch of any size.
      const double log_pair =
          log_alone + 0.5 * (pull[t] * pull[t] / information(t, t) - std::log(information(t, t)));
      if (log_pair <= best) continue;
      best = log_pair;
      doubtful = static_cast<std::size_t>(t);
    }
  }
  return doubtful;
}

Calibration with_drift(const Calibration& last, double months) {
  if (last.covariance.size() == 0)
    throw IdentifyError(IdentifyError::Kind::kCalibration,
                        "the last calibration states no covariance: nothing can stand on it");
  Calibration c = last;
  open_tip(c);
  for (std::size_t i = 0; i < c.parameters.size(); ++i) {
    const double each = per_root_month(c.parameters[i].key);
    const auto k = static_cast<Eigen::Index>(i);
    c.covariance(k, k) += each * each * std::max(0.0, months);  // (75)
  }
  return c;
}

std::optional<Eigen::MatrixXd> moved_by(const PossibleChange& change, const Calibration& c) {
  Eigen::MatrixXd columns =
      Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(c.parameters.size()), change.size);
  if (!fill(change, c, columns)) return std::nullopt;
  return columns;
}

}  // namespace cellcal::calib
