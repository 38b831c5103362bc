#include "calib/check/tcp_check.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "calib/check/explain.h"
#include "calib/model/error.h"

namespace cellcal::calib {

namespace {

/// What §9 of the method asks a check to find.
constexpr double kFindsM = 0.15e-3;
/// Beforehand, in odds: one check in a hundred finds something. It moves no threshold.
constexpr double kChangedBefore = 0.01;
/// A shift that nothing is known of beforehand.
constexpr double kAnyShiftM = 0.05;

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

/// Of all explanations; the weights are those from beforehand.
void share_out(std::vector<Explanation>& explanations, const std::vector<double>& weight) {
  double most = -std::numeric_limits<double>::infinity(), sum = 0.0;
  for (std::size_t k = 0; k < explanations.size(); ++k)
    most = std::max(most, explanations[k].log_likelihood + std::log(weight[k]));
  for (std::size_t k = 0; k < explanations.size(); ++k) {
    explanations[k].probability =
        std::exp(explanations[k].log_likelihood + std::log(weight[k]) - most);
    sum += explanations[k].probability;
  }
  for (Explanation& one : explanations) one.probability /= sum;
  std::stable_sort(explanations.begin(), explanations.end(),
                   [](const auto& a, const auto& b) { return a.probability > b.probability; });
}

/// Spheres of which nothing was met may have moved as well as the others.
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

/// Sigma of how far the end of a search is from its surface, by the calibration.
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
  double most = -std::numeric_limits<double>::infinity();
  std::vector<double> logs;
  for (const PossibleChange& change : with_spheres_of(missed, changes_)) {
    Explanation one = explain(change, contacts, alarm_.covariance(), unmet);
    logs.push_back(one.log_likelihood + std::log(change.weight));
    most = std::max(most, logs.back());
    if (change.kind == ChangeKind::kTouch) one.touch = planned[change.index];
    check.explanations.push_back(std::move(one));
    weight.push_back(kChangedBefore * change.weight);
  }
  double sum = 0.0;
  for (const double one : logs) sum += std::exp(one - most);
  check.log_odds = most + std::log(sum) - log_unmet(unmet);
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
  TcpCheck check;  // so few were met that nothing can be said of what is left
  check.touches = made.size();
  for (const MissedTouch& one : missed) check.not_found.push_back(not_found(calibration, one));
  return check;
}

namespace {

/// From what the touches hardly show to what ends a search.
const std::vector<double> kLengthsM{0.1e-3, 0.3e-3, 1e-3, 4e-3, 15e-3};
/// The same at a metre.
const std::vector<double> kAnglesRad = kLengthsM;
/// 2 to 20 K of aluminium and steel.
const std::vector<double> kGrowths{25e-6, 80e-6, 250e-6};

/// Arm and sphere once something has changed.
struct Place {
  Eigen::Vector3d tip_m, centre_m;
  Eigen::Matrix3d flange;
  double outside_m = 0.0;  ///< beside all geometry
};

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
      const ForeseenContact::Axis& axis = at.axes[change.index];
      place.tip_m =
          axis.origin + Eigen::AngleAxisd(*size, axis.direction) * (at.tip_m - axis.origin);
      break;
    }
    case ChangeKind::kGrowth:
      place.tip_m += *size * at.by_growth_m;
      break;
    case ChangeKind::kTouch:
      if (touch == change.index) place.outside_m = *size;
      break;
    case ChangeKind::kNothing:
      break;
  }
  return place;
}

void fill_row(const PossibleChange& change, const ForeseenContact& at, const Place& place,
              std::size_t touch, Eigen::Ref<Eigen::RowVectorXd, 0, Eigen::InnerStride<>> row) {
  const Eigen::RowVector3d n = (place.tip_m - place.centre_m).normalized().transpose();
  switch (change.kind) {
    case ChangeKind::kTool:
      row = n * place.flange;
      return;
    case ChangeKind::kSphere:
      if (at.target == change.name) row = -n;
      return;
    case ChangeKind::kJoint: {
      const ForeseenContact::Axis& axis = at.axes[change.index];
      row[0] = n * axis.direction.cross(place.tip_m - axis.origin);
      return;
    }
    case ChangeKind::kGrowth:
      row[0] = n * at.by_growth_m;
      return;
    case ChangeKind::kTouch:
      row[0] = touch == change.index ? 1.0 : 0.0;
      return;
    case ChangeKind::kNothing:
      return;
  }
}

}  // namespace

std::vector<PossibleChange> possible_changes(const Calibration& c,
                                             const std::vector<ForeseenContact>& contacts) {
  std::vector<std::string> spheres;
  for (const ForeseenContact& contact : contacts)
    if (std::ranges::find(spheres, contact.target) == spheres.end())
      spheres.push_back(contact.target);
  // What is knocked is the tool, mostly; next a stand. A zero that slips, and a touch that is wrong though
  // it was confirmed, are rare.
  constexpr double kTool = 0.4, kSphere = 0.25, kJoint = 0.15, kGrowth = 0.15, kTouch = 0.05;
  std::vector<PossibleChange> changes{
      {ChangeKind::kTool, c.cell.tool.name(), 0, 3, kTool, kLengthsM}};
  for (const std::string& id : spheres)
    changes.push_back(
        {ChangeKind::kSphere, id, 0, 3, kSphere / static_cast<double>(spheres.size()), kLengthsM});
  const std::vector<Joint>& joints = c.cell.robot.joints;
  for (std::size_t i = 0; i + 1 < joints.size(); ++i)
    changes.push_back({ChangeKind::kJoint, joints[i].name, i, 1,
                       kJoint / static_cast<double>(joints.size() - 1), kAnglesRad});
  changes.push_back({ChangeKind::kGrowth, "", 0, 1, kGrowth, kGrowths});
  for (std::size_t t = 0; t < contacts.size(); ++t)
    changes.push_back({ChangeKind::kTouch, contacts[t].target, t, 1,
                       kTouch / static_cast<double>(contacts.size()), kLengthsM});
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
    fill_row(change, at, place, touch, result.by_size.row(k));
  }
  return result;
}

Eigen::MatrixXd columns_of(const PossibleChange& change,
                           const std::vector<ForeseenContact>& contacts) {
  return changed(change, Eigen::VectorXd::Zero(change.size), contacts).by_size;
}

}  // namespace cellcal::calib
