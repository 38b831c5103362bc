#pragma once
// What the checks of one calibration say together: does the cell creep, since when, how fast, and what to do.
// calib/check works it out, calib/result has its sentences, calib/files writes it.

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "calib/result/tcp_check.h"

namespace cellcal::calib {

/// What keeps a check out of the chart; it is shown all the same.
enum class LeftOut {
  kNo,
  kUndecided,     ///< touches were given up, or its result is not recorded
  kIncomplete,    ///< it did not hold, and touches met nothing
  kNotTheTool,    ///< it did not hold, and a sphere, a joint or one touch explains it
  kOtherTouches,  ///< not those of the checks that are in the chart
};

/// One check, as a measurement of the TCP that repeats: what is the same in all checks is still in it.
struct CheckSeen {
  std::int64_t session = 0;
  double time_s = 0.0;  ///< since 1970, UTC
  std::optional<double> temperature_c = {};
  LeftOut left_out = LeftOut::kNo;
  CheckVerdict verdict = CheckVerdict::kUndecided;  ///< by itself
  /// Where it does not hold, by itself: the likeliest cause, and the TCP shift with its U(k=2); none where too few touches met
  /// anything.
  std::optional<Explanation> change = {};
  std::optional<double> tcp_shift_m = {};
  double u_tcp_shift_m = 0.0;
  Eigen::Vector3d shift_m = Eigen::Vector3d::Zero();            ///< of the TCP, flange frame
  Eigen::Matrix3d covariance_m2 = Eigen::Matrix3d::Identity();  ///< of what is another each time
};

enum class DriftState {
  kTooFew,     ///< checks, to say anything
  kInControl,  ///< what is seen is the scatter of single checks
  kWarns,
  kAlarms,   ///< also where the newest check that decided something does not hold
  kUnknown,  ///< was in control; the newest check is undecided, or too much time has passed since
};

enum class DriftAdvice { kNone, kCheckAgain, kLetItWarmUp, kRemeasureTcp, kRecalibrate };

/// Of both charts, in sigmas of their own; a cell in which nothing changes exceeds one of them once in so many checks.
struct ControlLimits {
  double ewma = 0.0, cusum = 0.0;
  double run_length = 0.0;
};

struct DriftPoint {
  CheckSeen check;
  /// Of the centre as it is known now, at the check's temperature where that is known [m].
  Eigen::Vector3d off_m = Eigen::Vector3d::Zero();
  double ewma = 0.0, cusum = 0.0;
  double share = 0.0;  ///< of the nearer alarm limit: above 1 it alarms
  DriftState state = DriftState::kTooFew;
};

enum class DriftShape { kStep, kCreep };

/// A rate per month is said of a creep that was watched so long: of less it is an extrapolation of more than tenfold.
inline constexpr double kShortestSpanOfARateS = 3.0 * 86400.0;
/// The checks up to the newest decided one that do not hold, without one between them that does.
struct NotHeld {
  std::int64_t since = 0;  ///< the first of them
  double since_s = 0.0;    ///< its time
  std::size_t checks = 0;
};

/// How the TCP best went off, by all checks in the chart.
struct DriftTrend {
  DriftShape shape = DriftShape::kCreep;
  std::int64_t since = 0;                           ///< the first check that is off
  double since_s = 0.0;                             ///< its time
  std::size_t checks = 0;                           ///< from it on
  Eigen::Vector3d now_m = Eigen::Vector3d::Zero();  ///< off at the newest check
  double now_sigma_m = 0.0;                         ///< along it
  double over_s = 0.0;                              ///< kCreep: from its begin to the newest check
  Eigen::Vector3d rate_m_s = Eigen::Vector3d::Zero();  ///< kCreep
  double rate_sigma_m_s = 0.0;
  bool has_rate() const { return shape == DriftShape::kCreep && over_s >= kShortestSpanOfARateS; }
  std::vector<Explanation> causes = {};  ///< likeliest first; empty: not worked out
};

struct DriftChart {
  std::size_t counted = 0;    ///< checks in the chart that held: its reference
  std::size_t least = 0;      ///< that it needs
  std::size_t undecided = 0;  ///< checks behind the newest that decided something
  DriftState state = DriftState::kTooFew;
  DriftAdvice advice = DriftAdvice::kNone;
  ControlLimits warns, alarms;
  double noise = 1.0;  ///< scatter of the checks by what the calibration states
  std::optional<Eigen::Vector3d> per_kelvin_m = {};  ///< where temperatures are known
  std::vector<DriftPoint> points = {};               ///< oldest first
  std::optional<DriftTrend> trend = {};              ///< where it warns or alarms
  std::optional<std::int64_t> alarmed_at = {};  ///< the check that raised the alarm that stands
  std::optional<NotHeld> not_held = {};         ///< the newest decided check does not hold

  /// The newest check that held or did not; null: none.
  const CheckSeen* newest_decided() const;
};

/// What to do about a check by itself.
DriftAdvice remedy_of(CheckVerdict verdict, ChangeKind change);
/// As files name it: "re_measure_tcp". Of a name that is none, nothing.
std::optional<DriftAdvice> drift_advice(const std::string& name);

const char* to_string(LeftOut why);
const char* to_string(DriftState state);
const char* to_string(DriftAdvice advice);
const char* to_string(DriftShape shape);

// The sentences of a control chart: number first, then what to do.

/// "in control: TCP 0.01 +- 0.04 mm (k=2) off the centre of 31 checks, 41 % of the alarm limit"
std::string state_words(const DriftChart& chart);
/// "creep of 0.048 +- 0.010 mm/month (k=2) since check 41 (2026-03-01), ..."; empty where there is none.
std::string trend_words(const DriftChart& chart);
/// What to do; empty: nothing.
std::string advice_words(const DriftChart& chart);
/// What the limits mean.
std::string limit_words(const DriftChart& chart);
/// All of it, a line each.
std::vector<std::string> words(const DriftChart& chart);

/// "2026-03-01" of seconds since 1970, UTC.
std::string date_words(double time_s);

}  // namespace cellcal::calib
