#include "calib/check/tcp_check.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "calib/check/explain.h"
#include "calib/model/error.h"
#include "calib/model/product.h"
#include "calib/model/units.h"

namespace cellcal::calib {

namespace {

/// Sizes from barely visible in the touches to large enough to end a search.
const std::vector<double> kLengthsM{0.1e-3, 0.3e-3, 1e-3, 4e-3, 15e-3};
/// The same sizes at a lever of 1 m.
const std::vector<double> kAnglesRad = kLengthsM;
/// Thermal growth by 2 to 20 K of aluminium and steel.
const std::vector<double> kGrowths{25e-6, 80e-6, 250e-6};

/// Arm and sphere after a change.
struct Place {
  Eigen::Vector3d tip_m, centre_m;
  Eigen::Matrix3d flange;
  double outside_m = 0.0;  ///< offset along the normal, independent of the geometry
};

/// Apparent tip position relative to a sphere on the positioner after a displacement (shift, rotation) of
/// its base; base frame.
Eigen::Vector3d seen_after(const ForeseenContact::Foot& foot, const double* motion,
                           const Eigen::Vector3d& tip_m) {
  const Eigen::Map<const Eigen::Vector3d> shift(motion), about(motion + 3);
  return foot.origin +  // (95a)
         turn(-(foot.base * about)) * (tip_m - foot.base * shift - foot.origin);
}

Place place_of(const PossibleChange& change, const double* size, const ForeseenContact& at,
               std::size_t touch) {
  Place place{at.tip_m, at.centre_m, at.flange};
  switch (change.kind) {
    case ChangeKind::kTool:
      place.tip_m += at.flange * Eigen::Map<const Eigen::Vector3d>(size);
      break;
    case ChangeKind::kSphere:
      if (at.target == change.name) place.centre_m += Eigen::Map<const Eigen::Vector3d>(size);
      break;
    case ChangeKind::kJoint: {
      if (change.index >= at.axes.size()) break;  // of a positioner, beside this sphere
      const ForeseenContact::Axis& axis = at.axes[change.index];
      place.tip_m =
          axis.origin + Eigen::AngleAxisd(*size, axis.direction) * (at.tip_m - axis.origin);
      break;
    }
    case ChangeKind::kPositioner:
      if (at.foot) place.tip_m = seen_after(*at.foot, size, at.tip_m);
      break;
    case ChangeKind::kGrowth: place.tip_m += *size * at.by_growth_m; break;
    case ChangeKind::kTouch:
      if (touch == change.index) place.outside_m = *size;
      break;
    case ChangeKind::kNothing: break;
  }
  return place;
}

void fill_row(const PossibleChange& change, const double* size, const ForeseenContact& at,
              const Place& place, std::size_t touch,
              Eigen::Ref<Eigen::RowVectorXd, 0, Eigen::InnerStride<>> row) {
  const Eigen::RowVector3d n = (place.tip_m - place.centre_m).normalized().transpose();
  switch (change.kind) {
    case ChangeKind::kTool: row = n * place.flange; return;
    case ChangeKind::kSphere:
      if (at.target == change.name) row = -n;
      return;
    case ChangeKind::kJoint: {
      if (change.index >= at.axes.size()) return;
      const ForeseenContact::Axis& axis = at.axes[change.index];
      row[0] = n * axis.direction.cross(place.tip_m - axis.origin);
      return;
    }
    case ChangeKind::kPositioner: {
      if (!at.foot) return;
      const Eigen::Matrix3d& base = at.foot->base;
      const Eigen::Vector3d back = -(base * Eigen::Map<const Eigen::Vector3d>(size + 3));
      const Eigen::Vector3d lever = place.tip_m - at.foot->origin;
      row.head<3>() = -n * turn(back) * base;
      row.tail<3>() = -lever.cross(n.transpose()).transpose() * turn_derivative(back) * base;
      return;
    }
    case ChangeKind::kGrowth: row[0] = n * at.by_growth_m; return;
    case ChangeKind::kTouch: row[0] = touch == change.index ? 1.0 : 0.0; return;
    case ChangeKind::kNothing: return;
  }
}

/// About 200 draws exceed the threshold: a relative error of 1/14 in the false alarm rate.
constexpr Eigen::Index kDraws = 200'000;
constexpr Eigen::Index kFindDraws = 4000;
constexpr Eigen::Index kBlock = 1000;  ///< draws per block
constexpr unsigned kSeed = 20251122;

Eigen::MatrixXd drawn(Eigen::Index rows, Eigen::Index columns, Random& random) {
  Eigen::MatrixXd draws(rows, columns);
  for (double& one : draws.reshaped()) one = random.normal();
  return draws;
}

/// Shift that a check is required to find (method, section 9).
constexpr double kFindsM = 0.15e-3;
/// Prior odds of a change: one check in a hundred. Does not affect the threshold.
constexpr double kChangedBefore = 0.01;

Foresight foreseen(const Calibration& calibration, const std::vector<Touch>& expected,
                   const std::vector<std::vector<Touch>>& references) {
  if (expected.size() < kLeastCheckTouches)
    throw IdentifyError(IdentifyError::Kind::kUndetermined,
                        fmt::format("a check needs at least {} touches, {} were made",
                                    kLeastCheckTouches, expected.size()));
  Foresight foresight = foresee(calibration, expected);
  const std::size_t count = std::min(references.size(), kMostReferences);
  Eigen::MatrixXd off_m(static_cast<Eigen::Index>(expected.size()),
                        static_cast<Eigen::Index>(count));
  for (std::size_t k = 0; k < count; ++k) {
    if (references[k].size() != expected.size())
      throw IdentifyError(IdentifyError::Kind::kTouches, "an earlier check is of other touches");
    off_m.col(static_cast<Eigen::Index>(k)) =
        residuals_m(foreseen_contacts(calibration, references[k]));
  }
  refer_to(foresight, off_m);
  return foresight;
}

/// Adds the spheres without any contact as candidates for a displacement.
std::vector<PossibleChange> with_spheres_of(const std::vector<MissedTouch>& missed,
                                            std::vector<PossibleChange> changes) {
  const auto of = [&](const std::string& id) {
    return std::ranges::find_if(changes, [&](const PossibleChange& change) {
      return change.kind == ChangeKind::kSphere && (id.empty() || change.name == id);
    });
  };
  for (const MissedTouch& one : missed) {
    if (of(one.at_end.target) != changes.end()) continue;
    PossibleChange sphere = *of("");
    sphere.name = one.at_end.target;
    changes.push_back(std::move(sphere));
  }
  return changes;
}

NotFound not_found(const Calibration& calibration, const MissedTouch& missed) {
  const double gap_m = residuals_m(foreseen_contacts(calibration, {missed.at_end}))[0];
  return {missed.planned, missed.at_end.target, -gap_m};
}

/// End of each search relative to its surface, with sigma by the calibration.
std::vector<Unmet> unmet_of(const Calibration& calibration,
                            const std::vector<MissedTouch>& missed) {
  if (missed.empty()) return {};
  std::vector<Touch> ends;
  for (const MissedTouch& one : missed) ends.push_back(one.at_end);
  const Foresight foresight = foresee(calibration, ends);
  std::vector<Unmet> unmet;
  for (std::size_t k = 0; k < missed.size(); ++k) {
    const auto i = static_cast<Eigen::Index>(k);
    unmet.push_back(
        {missed[k].planned, foresight.contacts[k], std::sqrt(foresight.covariance_m2()(i, i))});
  }
  return unmet;
}

}  // namespace

std::vector<PossibleChange> possible_changes(const Calibration& c,
                                             const std::vector<ForeseenContact>& contacts) {
  std::vector<std::string> spheres;
  for (const ForeseenContact& contact : contacts)
    if (std::ranges::find(spheres, contact.target) == spheres.end())
      spheres.push_back(contact.target);
  // Tools are displaced most often, then spheres; a joint's zero rarely slips, and a confirmed
  // touch is rarely wrong.
  constexpr double kTool = 0.4, kSphere = 0.25, kJoint = 0.15, kGrowth = 0.15, kTouch = 0.05,
                   kPositioner = 0.15;
  std::vector<PossibleChange> changes{
      {ChangeKind::kTool, c.cell.tool.name(), 0, 3, kTool, kLengthsM}};
  for (const std::string& id : spheres)
    changes.push_back(
        {ChangeKind::kSphere, id, 0, 3, kSphere / static_cast<double>(spheres.size()), kLengthsM});
  const std::vector<Joint>& joints = c.cell.robot.joints;
  // A linear unit's zero that slipped looks as the arm's foot moved, which is no single change either.
  const std::size_t first = c.cell.robot.first_turning();
  const std::vector<PositionerAxis>& axes = c.cell.robot.positioner;
  const double each = kJoint / static_cast<double>(joints.size() - 1 - first + axes.size());
  for (std::size_t i = first; i + 1 < joints.size(); ++i)
    changes.push_back({ChangeKind::kJoint, joints[i].name, i, 1, each, kAnglesRad});
  for (std::size_t j = 0; j < axes.size(); ++j)
    changes.push_back({ChangeKind::kJoint, axes[j].name, joints.size() + j, 1, each, kAnglesRad});
  changes.push_back({ChangeKind::kGrowth, "", 0, 1, kGrowth, kGrowths});
  for (std::size_t t = 0; t < contacts.size(); ++t)
    changes.push_back({ChangeKind::kTouch, contacts[t].target, t, 1,
                       kTouch / static_cast<double>(contacts.size()), kLengthsM});
  if (!axes.empty()) {
    for (PossibleChange& change : changes) change.weight *= 1.0 - kPositioner;
    changes.push_back({ChangeKind::kPositioner, axes[0].name, 0, 6, kPositioner, kLengthsM});
  }
  return changes;
}

Changed changed(const PossibleChange& change, const Eigen::VectorXd& size,
                const std::vector<ForeseenContact>& contacts) {
  const auto n = static_cast<Eigen::Index>(contacts.size());
  Changed result{Eigen::VectorXd(n), Eigen::MatrixXd::Zero(n, change.size)};
  for (Eigen::Index k = 0; k < n; ++k) {
    const auto touch = static_cast<std::size_t>(k);
    const ForeseenContact& at = contacts[touch];
    const Place place = place_of(change, size.data(), at, touch);
    result.off_m[k] =
        (place.tip_m - place.centre_m).norm() - at.radius_m - at.offset_m + place.outside_m;
    fill_row(change, size.data(), at, place, touch, result.by_size.row(k));
  }
  return result;
}

Eigen::MatrixXd columns_of(const PossibleChange& change,
                           const std::vector<ForeseenContact>& contacts) {
  return changed(change, Eigen::VectorXd::Zero(change.size), contacts).by_size;
}

Alarm::Alarm(const std::vector<PossibleChange>& changes,
             const std::vector<ForeseenContact>& contacts, const Eigen::MatrixXd& covariance_m2)
    : covariance_(covariance_m2) {
  const Eigen::Index n = covariance_m2.rows();
  Eigen::Index all = 0;
  for (const PossibleChange& change : changes) all += change.size;
  directions_.resize(n, all);
  square_.resize(all);
  Eigen::Index first = 0;
  for (const PossibleChange& change : changes) {
    const Eigen::MatrixXd by = covariance_.whitened(columns_of(change, contacts));
    if (change.kind == ChangeKind::kTool) by_tool_ = by;
    const Eigenpairs pairs = eigenpairs(by.transpose() * by);
    for (Eigen::Index k = 0; k < change.size; ++k) {
      const double square = std::max(0.0, pairs.values[k]);
      const Eigen::VectorXd moved = by * pairs.vectors.col(k);
      square_[first + k] = square;
      directions_.col(first + k) =
          square > 0.0 ? Eigen::VectorXd(moved / std::sqrt(square)) : Eigen::VectorXd::Zero(n);
    }
    parts_.push_back({first, change.size, change.weight, change.usual});
    first += change.size;
  }
  Random random(kSeed);
  std::vector<double> odds;
  for (Eigen::Index k = 0; k < kDraws; k += kBlock) {
    const Eigen::VectorXd block = log_odds_of(drawn(n, kBlock, random));
    odds.insert(odds.end(), block.begin(), block.end());
  }
  const auto at = static_cast<std::ptrdiff_t>((1.0 - kFalseAlarms) * static_cast<double>(kDraws));
  std::nth_element(odds.begin(), odds.begin() + at, odds.end());
  threshold_ = odds[static_cast<std::size_t>(at)];
}

Eigen::VectorXd Alarm::log_odds_of(const Eigen::MatrixXd& whitened) const {
  const Eigen::MatrixXd along = product(directions_.transpose(), whitened).array().square();
  Eigen::ArrayXd sum = Eigen::ArrayXd::Zero(whitened.cols());
  for (const Part& part : parts_)
    for (const double usual : part.usual) {
      const Eigen::ArrayXd gain = usual * usual * square_.segment(part.first, part.size).array();
      const Eigen::ArrayXd share = 0.5 * gain / (1.0 + gain);
      const double volume = 0.5 * (1.0 + gain).log().sum();
      const Eigen::ArrayXd exponent =
          (share.matrix().transpose() * along.middleRows(part.first, part.size))
              .transpose()
              .array() -
          volume;
      constexpr double kMost = 600.0;  // above any threshold, finite
      sum += part.weight / static_cast<double>(part.usual.size()) * exponent.min(kMost).exp();
    }
  return sum.log();
}

double Alarm::log_odds(const Eigen::VectorXd& whitened) const { return log_odds_of(whitened)[0]; }

double Alarm::found(double shift_m) const {
  Random random(kSeed + 1);
  Eigen::MatrixXd whitened = drawn(by_tool_.rows(), kFindDraws, random);
  Eigen::MatrixXd shifts = drawn(3, kFindDraws, random);
  shifts.colwise().normalize();
  whitened += shift_m * by_tool_ * shifts;
  const auto above = (log_odds_of(whitened).array() > threshold_).count();
  return static_cast<double>(above) / static_cast<double>(kFindDraws);
}

TcpChecker::TcpChecker(const Calibration& calibration, const std::vector<Touch>& expected,
                       const std::vector<std::vector<Touch>>& references)
    : calibration_(calibration),
      foresight_(foreseen(calibration, expected, references)),
      changes_(possible_changes(calibration, foresight_.contacts)),
      alarm_(changes_, foresight_.contacts, foresight_.covariance_m2()),
      found_(alarm_.found(kFindsM)) {}

Eigen::Matrix3d TcpChecker::shift_covariance_m2() const {
  PossibleChange tool = changes_.front();
  return fit(tool, kAnyShiftM, foresight_.contacts, alarm_.covariance()).covariance;
}

TcpCheck TcpChecker::judge(const std::vector<Touch>& made) const {
  std::vector<std::size_t> planned(made.size());
  std::iota(planned.begin(), planned.end(), std::size_t{0});
  return judge(made, planned, {});
}

TcpCheck TcpChecker::judge(const std::vector<Touch>& made, const std::vector<std::size_t>& planned,
                           const std::vector<MissedTouch>& missed) const {
  if (made.size() != foresight_.contacts.size())
    throw IdentifyError(
        IdentifyError::Kind::kTouches,
        fmt::format("{} touches were expected, {} made", foresight_.contacts.size(), made.size()));
  auto contacts = foreseen_contacts(calibration_, made);
  for (std::size_t t = 0; t < contacts.size(); ++t)
    contacts[t].offset_m = foresight_.contacts[t].offset_m;
  const std::vector<Unmet> unmet = unmet_of(calibration_, missed);
  TcpCheck check;
  check.touches = made.size();
  const Eigen::VectorXd off = residuals_m(contacts);
  check.rms_m = std::sqrt(off.squaredNorm() / static_cast<double>(off.size()));
  const Fitted shift = fit(changes_.front(), kAnyShiftM, contacts, alarm_.covariance());
  check.shift_m = shift.size;
  check.covariance_m2 = shift.covariance;

  std::vector<double> weight{1.0 - kChangedBefore};
  check.explanations.emplace_back();
  check.explanations.back().log_likelihood = log_unmet(unmet);
  std::vector<double> logs;
  for (const PossibleChange& change : with_spheres_of(missed, changes_)) {
    Explanation one = explain(change, contacts, alarm_.covariance(), unmet);
    logs.push_back(one.log_likelihood + std::log(change.weight));
    if (change.kind == ChangeKind::kTouch) one.touch = planned[change.index];
    // One shift has one size: that of the check, which no usual size draws towards zero.
    if (check.explanations.size() == 1 && one.kind == ChangeKind::kTool && one.amount == 0.0)
      put_size(shift.size, shift.covariance, one);
    check.explanations.push_back(std::move(one));
    weight.push_back(kChangedBefore * change.weight);
  }
  check.log_odds = log_sum(logs) - log_unmet(unmet);
  share_out(check.explanations, weight);

  check.log_alarm = alarm_.threshold();
  check.false_alarms = kFalseAlarms;
  check.finds_m = kFindsM;
  check.found = found_;
  for (const MissedTouch& one : missed) check.not_found.push_back(not_found(calibration_, one));
  check.holds = check.not_found.empty() && check.log_odds <= check.log_alarm;
  return check;
}

TcpCheck check_tcp(const Calibration& calibration, const std::vector<Touch>& made,
                   const std::vector<std::size_t>& planned, const std::vector<MissedTouch>& missed,
                   const std::vector<std::vector<Touch>>& references) {
  if (made.size() >= kLeastCheckTouches || missed.empty())
    return TcpChecker(calibration, made, references).judge(made, planned, missed);
  TcpCheck check;  // too few contacts for any explanation
  check.touches = made.size();
  for (const MissedTouch& one : missed) check.not_found.push_back(not_found(calibration, one));
  return check;
}

}  // namespace cellcal::calib
