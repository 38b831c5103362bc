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

/// Normalises the probabilities of all explanations; `weight`: their prior weights.
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
  TcpCheck check;  // too few contacts for any explanation
  check.touches = made.size();
  for (const MissedTouch& one : missed) check.not_found.push_back(not_found(calibration, one));
  return check;
}

}  // namespace cellcal::calib
