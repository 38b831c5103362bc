#include "calib/check/shift_gauge.h"

#include <algorithm>
#include <cmath>

#include "calib/check/explain.h"
#include "calib/model/error.h"

namespace cellcal::calib {

namespace {

/// Prior sigma of a shift without prior knowledge.

void share_out(std::vector<Explanation>& all, const std::vector<PossibleChange>& changes) {
  double most = -1e300, sum = 0.0;
  for (std::size_t k = 0; k < all.size(); ++k)
    most = std::max(most, all[k].log_likelihood + std::log(changes[k].weight));
  for (std::size_t k = 0; k < all.size(); ++k)
    sum += all[k].probability =
        std::exp(all[k].log_likelihood + std::log(changes[k].weight) - most);
  for (Explanation& one : all) one.probability /= sum;
  std::stable_sort(all.begin(), all.end(),
                   [](const auto& a, const auto& b) { return a.probability > b.probability; });
}

}  // namespace

ShiftGauge::ShiftGauge(const Calibration& calibration, const std::vector<Touch>& expected)
    : calibration_(calibration),
      foresight_(foresee(calibration, expected)),
      changes_(possible_changes(calibration, foresight_.contacts)),
      passing_(foresight_.passing_m2) {
  if (expected.size() < kLeastCheckTouches)
    throw IdentifyError(IdentifyError::Kind::kUndetermined,
                        "too few touches for a shift of the TCP");
}

ShiftGauge::Shift ShiftGauge::measure(const std::vector<Touch>& made) const {
  if (made.size() != touches())
    throw IdentifyError(IdentifyError::Kind::kTouches, "a check of other touches");
  const auto contacts = foreseen_contacts(calibration_, made);
  const Fitted shift = fit(changes_.front(), kAnyShiftM, contacts, passing_);
  return {shift.size, shift.covariance, residuals_m(contacts)};
}

std::vector<Explanation> ShiftGauge::causes(const Eigen::VectorXd& off_m, double scatter) const {
  std::vector<ForeseenContact> contacts = foresight_.contacts;
  const Eigen::VectorXd here = residuals_m(contacts);
  for (std::size_t t = 0; t < contacts.size(); ++t) {
    const auto i = static_cast<Eigen::Index>(t);
    contacts[t].offset_m += here[i] - off_m[i];
  }
  const Cholesky covariance(scatter * foresight_.passing_m2);
  std::vector<Explanation> all;
  for (const PossibleChange& change : changes_)
    all.push_back(explain(change, contacts, covariance, {}));
  share_out(all, changes_);
  return all;
}

}  // namespace cellcal::calib
