#include "calib/check/drift.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <utility>

#include "calib/check/charts.h"
#include "calib/check/explain.h"
#include "calib/model/error.h"

namespace cellcal::calib {

namespace {

/// Distance from all temperatures in the chart beyond which a temperature is unusual.
constexpr double kUnusualK = 5.0;
constexpr double kDayS = 86400.0;

/// Centre, temperature coefficient, and the trend's three components.
using Normal = Eigen::Matrix<double, 9, 9>;
using Right = Eigen::Matrix<double, 9, 1>;

/// Minimum duration of a creep: checks of one day give no rate per month. Times of the fit are in days, for the
/// conditioning of the normal equations.
constexpr double kShortestCreepS = kDayS;

/// Normal equations of centre, temperature coefficient and one trend: found = centre + per_K warm +
/// size basis.
struct Fit {
  Normal normal = Normal::Zero();
  Right right = Right::Zero();

  void add(const CheckMeasurement& check, const Eigen::Matrix3d& weight, double warm,
           double basis) {
    const double by[3] = {1.0, warm, basis};
    const Eigen::Vector3d weighted = weight * check.shift_m;
    for (int a = 0; a < 3; ++a) {
      right.segment<3>(3 * a) += by[a] * weighted;
      for (int b = 0; b < 3; ++b) normal.block<3, 3>(3 * a, 3 * b) += by[a] * by[b] * weight;
    }
  }
};

struct Best {
  double gain = -1.0;
  std::size_t from = 0;
  DriftShape shape = DriftShape::kStep;
  Eigen::Vector3d size = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
};

double basis_of(DriftShape shape, const std::vector<CheckMeasurement>& checks, std::size_t from,
                std::size_t k) {
  if (k < from) return 0.0;
  if (shape == DriftShape::kStep) return 1.0;
  return (checks[k].time_s - checks[from - 1].time_s) / kDayS;
}

/// Onset and rate of the TCP's shift: the step or linear creep, from any check on, with the smallest remaining
/// residuals. `checks`: chronological; the first is never part of the trend. Empty for fewer than two checks. `noise`:
/// scatter of the checks relative to the stated one. `reference_c`: as for the charts.
std::optional<DriftTrend> trend_of(const std::vector<CheckMeasurement>& checks, double noise,
                                   std::optional<double> reference_c) {
  if (checks.size() < 2) return std::nullopt;
  std::vector<Eigen::Matrix3d> weights;
  std::vector<double> warm;
  Normal fixed = Normal::Zero();
  fixed.block<3, 3>(3, 3) = Eigen::Matrix3d::Identity() / (kPerKelvinM * kPerKelvinM);
  for (const CheckMeasurement& check : checks) {
    weights.push_back((noise * noise * check.covariance_m2).inverse());
    warm.push_back(reference_c && check.temperature_c ? *check.temperature_c - *reference_c : 0.0);
  }
  // Candidate onsets are thinned out if there are hundreds: the onset of a creep is not known to a
  // single check.
  constexpr std::size_t kMostCandidates = 150;
  const std::size_t stride = 1 + checks.size() / kMostCandidates;
  Best best;
  for (std::size_t from = checks.size() - 1; from >= 1; from -= std::min(from, stride)) {
    const bool lasts = checks.back().time_s - checks[from - 1].time_s >= kShortestCreepS;
    for (const DriftShape shape : {DriftShape::kStep, DriftShape::kCreep}) {
      if (shape == DriftShape::kCreep && !lasts) continue;
      Fit fit;
      fit.normal = fixed;
      for (std::size_t k = 0; k < checks.size(); ++k)
        fit.add(checks[k], weights[k], warm[k], basis_of(shape, checks, from, k));
      if (!(fit.normal.diagonal().tail<3>().minCoeff() > 0.0)) continue;  // times out of order
      const Eigen::LDLT<Normal> factor(fit.normal);
      const Right solution = factor.solve(fit.right);
      const double gain = solution.dot(fit.right);
      if (!(gain > best.gain)) continue;
      const Normal inverse = factor.solve(Normal::Identity());
      best = {gain, from, shape, solution.tail<3>(), inverse.bottomRightCorner<3, 3>()};
    }
  }
  if (best.gain < 0.0) return std::nullopt;
  DriftTrend trend;
  trend.shape = best.shape;
  trend.since = checks[best.from].session;
  trend.since_s = checks[best.from].time_s;
  trend.checks = checks.size() - best.from;
  const double now = basis_of(best.shape, checks, best.from, checks.size() - 1);
  trend.now_m = now * best.size;
  trend.now_sigma_m = now * sigma_along(best.covariance, best.size);
  if (best.shape == DriftShape::kCreep) {
    trend.over_s = checks.back().time_s - checks[best.from - 1].time_s;
    trend.rate_m_s = best.size / kDayS;
    trend.rate_sigma_m_s = sigma_along(best.covariance, best.size) / kDayS;
  }
  return trend;
}

bool beyond(const Charts::Statistics& at, const ControlLimits& limits) {
  return !(at.ewma <= limits.ewma && at.cusum <= limits.cusum);  // NaN is not in control
}

/// Evaluates the charts check by check.
class Watch {
 public:
  explicit Watch(std::optional<double> reference_c)
      : reference_c_(reference_c), charts_(reference_c) {
    chart_.least = kLeastChecks;
    chart_.warns = kWarnLimits;
    chart_.alarms = kAlarmLimits;
  }

  void take(const CheckMeasurement& check) {
    DriftPoint point;
    point.check = check;
    const bool held = check.verdict == CheckVerdict::kHolds;
    // Checks that do not hold are compared with the centre but not included in it.
    if (check.left_out == LeftOut::kNo && (held || charts_.centre().known())) {
      const Charts::Statistics at = charts_.take(check);
      point.ewma = at.ewma;
      point.cusum = at.cusum;
      point.share = std::max(at.ewma / kAlarmLimits.ewma, at.cusum / kAlarmLimits.cusum);
      trend_checks_.push_back(check);
      if (held) ++chart_.counted;
      at_ = at;
      if (!held || by_statistics() == DriftState::kAlarms)
        freeze(check);
      else
        go_on(check);
    }
    examine_newest(check);
    point.state = chart_.state;
    chart_.points.push_back(point);
  }

  DriftChart chart() && {
    for (DriftPoint& point : chart_.points)
      if (charts_.centre().known()) point.off_m = charts_.centre().against(point.check).off_m;
    chart_.noise = charts_.scatter();
    chart_.per_kelvin_m = charts_.centre().per_kelvin_m();
    // A check that holds after one that did not: the tool was put back, which is neither a step nor a
    // creep.
    const bool put_back = failed_ && !chart_.not_held;
    if ((chart_.alarmed_at && !put_back) || by_statistics() == DriftState::kWarns)
      chart_.trend = trend_of(trend_checks_, charts_.scatter(), reference_c_);
    return std::move(chart_);
  }

 private:
  /// An alarm persists until both statistics are below their warning limits, regardless of the number of
  /// checks.
  DriftState by_statistics() const {
    const bool enough = chart_.counted >= kLeastChecks;
    if (enough && beyond(at_, kAlarmLimits)) return DriftState::kAlarms;
    if (beyond(at_, kWarnLimits)) {
      if (chart_.alarmed_at) return DriftState::kAlarms;
      if (enough) return DriftState::kWarns;
    }
    return enough ? DriftState::kInControl : DriftState::kTooFew;
  }

  /// The state is never better than that of the newest check.
  void examine_newest(const CheckMeasurement& check) {
    switch (check.verdict) {
      case CheckVerdict::kUndecided:
        ++chart_.undecided;
        if (chart_.state == DriftState::kInControl) chart_.state = DriftState::kUnknown;
        return;
      case CheckVerdict::kDoesNotHold:
        if (!chart_.not_held) chart_.not_held = NotHeld{check.session, check.time_s, 0};
        ++chart_.not_held->checks;
        chart_.state = DriftState::kAlarms;
        break;
      case CheckVerdict::kHolds:
        chart_.not_held.reset();
        chart_.state = by_statistics();
        break;
    }
    chart_.undecided = 0;
  }

  /// The centre keeps its value from before the alarm.
  void freeze(const CheckMeasurement& check) {
    if (chart_.alarmed_at) return;
    chart_.alarmed_at = check.session;
    failed_ = check.verdict != CheckVerdict::kHolds;
    const auto trend = trend_of(trend_checks_, charts_.scatter(), reference_c_);
    trusted_ = trend_checks_.size() - (trend ? trend->checks : 1);
    Centre centre(reference_c_);
    for (std::size_t k = 0; k < trusted_; ++k) centre.learn(trend_checks_[k]);
    charts_.refer_to(centre);
  }

  void go_on(const CheckMeasurement& check) {
    if (chart_.alarmed_at) {  // cleared, or false alarm
      trend_checks_.resize(trusted_);
      trend_checks_.push_back(check);
      chart_.alarmed_at.reset();
      failed_ = false;
    }
    charts_.learn(check);
  }

  std::optional<double> reference_c_;
  Charts charts_;
  DriftChart chart_;
  Charts::Statistics at_;  ///< of the newest check in the chart
  /// Checks that the centre is estimated from, and those since the current alarm.
  std::vector<CheckMeasurement> trend_checks_;
  std::size_t trusted_ = 0;  ///< number of them before the current alarm's trend
  bool failed_ = false;      ///< the alarm was raised by a check that did not hold
};

/// True if the temperature of the newest check in the chart is outside the range of the others.
bool unusual_temperature(const DriftChart& chart) {
  const auto last =
      std::find_if(chart.points.rbegin(), chart.points.rend(),
                   [](const DriftPoint& one) { return one.check.left_out == LeftOut::kNo; });
  const auto newest = last == chart.points.rend() ? std::nullopt : last->check.temperature_c;
  double nearest = kUnusualK;
  bool others = false;
  for (const DriftPoint& point : chart.points) {
    const CheckMeasurement& check = point.check;
    if (!newest || &point == &*last || !check.temperature_c || check.left_out != LeftOut::kNo)
      continue;
    others = true;
    nearest = std::min(nearest, std::abs(*check.temperature_c - *newest));
  }
  return others && nearest >= kUnusualK;
}

/// An alarm of the statistics that a single check may resolve is no statement yet.
bool is_of_one_check(const DriftChart& chart) { return !chart.trend || chart.trend->checks == 1; }

DriftAdvice advice_for(const DriftChart& chart) {
  if (chart.points.empty()) return DriftAdvice::kNone;
  const CheckMeasurement& newest = chart.points.back().check;
  // Without a new measurement an alarm of the statistics keeps its remedy.
  const bool adds_nothing = newest.verdict == CheckVerdict::kUndecided &&
                            chart.state == DriftState::kAlarms && !chart.not_held;
  if (newest.verdict != CheckVerdict::kHolds && !adds_nothing)
    return remedy_of(newest.verdict, newest.change ? newest.change->kind : ChangeKind::kNothing);
  if (chart.state == DriftState::kWarns || chart.state == DriftState::kUnknown)
    return DriftAdvice::kCheckAgain;
  if (chart.state != DriftState::kAlarms) return DriftAdvice::kNone;
  if (is_of_one_check(chart)) return DriftAdvice::kCheckAgain;
  if (unusual_temperature(chart)) return DriftAdvice::kLetItWarmUp;
  if (!chart.trend->causes.empty())
    return remedy_of(CheckVerdict::kDoesNotHold, chart.trend->causes.front().kind);
  return DriftAdvice::kReMeasureTcp;
}

/// temp_0: the first known temperature of the checks that count.
std::optional<double> reference_temperature_c(const std::vector<CheckMeasurement>& checks) {
  for (const CheckMeasurement& check : checks)
    if (check.left_out == LeftOut::kNo && check.temperature_c) return check.temperature_c;
  return std::nullopt;
}

Holding holding_of(const DriftChart& chart, bool current) {
  if (chart.not_held) return Holding::kDoesNotHold;
  if (chart.state == DriftState::kAlarms)
    return is_of_one_check(chart) ? Holding::kUnknown : Holding::kDoesNotHold;
  const bool known = chart.state != DriftState::kUnknown && chart.undecided == 0 && current;
  return known ? Holding::kHolds : Holding::kUnknown;
}

}  // namespace

DriftChart drift_chart(const std::vector<CheckMeasurement>& checks) {
  Watch watch(reference_temperature_c(checks));
  for (const CheckMeasurement& check : checks) watch.take(check);
  DriftChart chart = std::move(watch).chart();
  advise(chart);
  return chart;
}

bool is_current(double evidence_s, double now_s) {
  return now_s <= evidence_s + kMostDays * kDayS && now_s >= evidence_s - kDayS;
}

void age(DriftChart& chart, double now_s) {
  if (chart.state != DriftState::kInControl) return;
  const CheckMeasurement* decided = chart.newest_decided();
  if (decided == nullptr || is_current(decided->time_s, now_s)) return;
  chart.state = DriftState::kUnknown;
  advise(chart);
}

Standing standing_of(const DriftChart& chart, double calibrated_s, double now_s) {
  const CheckMeasurement* decided = chart.newest_decided();
  Standing standing;
  standing.by_check = decided != nullptr;
  standing.evidence_s = decided != nullptr ? decided->time_s : calibrated_s;
  standing.due_s = standing.evidence_s + kMostDays * kDayS;
  standing.holding = holding_of(chart, is_current(standing.evidence_s, now_s));
  return standing;
}

void advise(DriftChart& chart) { chart.advice = advice_for(chart); }

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
  std::vector<double> weight;
  for (const PossibleChange& change : changes_) {
    all.push_back(explain(change, contacts, covariance, {}));
    weight.push_back(change.weight);
  }
  share_out(all, weight);
  return all;
}

}  // namespace cellcal::calib
