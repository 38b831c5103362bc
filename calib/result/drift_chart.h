#pragma once
// Joint evaluation of all checks of one calibration: drift, onset, rate, and advice. calib/check computes it,
// calib/result words it, calib/files writes it.

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "calib/model/enum_table.h"
#include "calib/result/tcp_check.h"
#include "calib/words/phrase.h"

namespace cellcal::calib {

// Changes of a cell that its chart of checks is read with.

enum class DriftEventKind {
  kCalibrated,
  kUpdated,    ///< a few touches on top of the calibration before
  kActivated,  ///< an earlier calibration put into use again
};

constexpr const char* to_string(DriftEventKind kind) { return own_name(kind); }

/// A calibration that came into use, and what differs from the cell file of the one published before.
struct DriftEvent {
  DriftEventKind kind = DriftEventKind::kCalibrated;
  std::int64_t session = 0;  ///< of the calibration
  double time_s = 0.0;       ///< since 1970, UTC; 0: unknown
  bool cell_changed = false, robot_changed = false;
  std::optional<double> tcp_moved_m =
      {};                            ///< another tool: distance of its TCP from the one before
  bool accepted = false;             ///< a change of the arm, by an operator
  std::string by = {}, reason = {};  ///< kActivated
};

/// "update (session 12): tool changed, TCP moved by 1.250 mm"
Phrase phrase(const DriftEvent& event);

/// Reason for leaving a check out of the chart; it is still displayed.
enum class LeftOut {
  kNo,
  kUndecided,     ///< touches were abandoned, or its result is not recorded
  kIncomplete,    ///< it did not hold, with touches without contact
  kNotTheTool,    ///< it did not hold, explained by a sphere, a joint or one touch
  kOtherTouches,  ///< touches differ from those of the checks in the chart
};

/// One check as a repeatable measurement of the TCP: constant errors of the checks are included.
struct CheckMeasurement {
  std::int64_t session = 0;
  double time_s = 0.0;  ///< since 1970, UTC
  std::optional<double> temperature_c = {};
  LeftOut left_out = LeftOut::kNo;
  CheckVerdict verdict = CheckVerdict::kUndecided;  ///< of the check alone
  /// If it does not hold: the most likely cause and the TCP shift with its U(k=2); empty if too few touches made
  /// contact.
  std::optional<Explanation> change = {};
  std::optional<double> tcp_shift_m = {};
  double u_tcp_shift_m = 0.0;
  Eigen::Vector3d shift_m = Eigen::Vector3d::Zero();            ///< of the TCP, flange frame
  Eigen::Matrix3d covariance_m2 = Eigen::Matrix3d::Identity();  ///< of the independent part
};

enum class DriftState {
  kTooFew,     ///< too few checks
  kInControl,  ///< changes are within the scatter of single checks
  kWarns,
  kAlarms,   ///< also if the newest decided check does not hold
  kUnknown,  ///< was in control; the newest check is undecided or too long ago
};

enum class DriftAdvice { kNone, kCheckAgain, kLetItWarmUp, kReMeasureTcp, kRecalibrate };

/// Limits of both charts, in their own sigmas; an unchanged cell exceeds one of them once per this many checks.
struct ControlLimits {
  double ewma = 0.0, cusum = 0.0;
  double run_length = 0.0;
};

struct DriftPoint {
  CheckMeasurement check;
  /// Relative to the current centre, at the check's temperature if known [m].
  Eigen::Vector3d off_m = Eigen::Vector3d::Zero();
  double ewma = 0.0, cusum = 0.0;
  double share = 0.0;  ///< of the nearer alarm limit: above 1 is an alarm
  DriftState state = DriftState::kTooFew;
};

enum class DriftShape { kStep, kCreep };

/// Minimum duration for stating a rate per month; shorter ones would be extrapolated more than tenfold.
inline constexpr double kShortestSpanOfARateS = 3.0 * 86400.0;
/// The consecutive checks that do not hold, up to the newest decided one.
struct NotHeld {
  std::int64_t since = 0;  ///< the first of them
  double since_s = 0.0;    ///< its time
  std::size_t checks = 0;
};

/// Best-fitting trend of the TCP over all checks in the chart.
struct DriftTrend {
  DriftShape shape = DriftShape::kCreep;
  std::int64_t since = 0;                           ///< the first check of the trend
  double since_s = 0.0;                             ///< its time
  std::size_t checks = 0;                           ///< number of checks in the trend
  Eigen::Vector3d now_m = Eigen::Vector3d::Zero();  ///< deviation at the newest check
  double now_sigma_m = 0.0;                         ///< along it
  double over_s = 0.0;                              ///< kCreep: from its onset to the newest check
  Eigen::Vector3d rate_m_s = Eigen::Vector3d::Zero();  ///< kCreep
  double rate_sigma_m_s = 0.0;
  bool has_rate() const { return shape == DriftShape::kCreep && over_s >= kShortestSpanOfARateS; }
  std::vector<Explanation> causes = {};  ///< most likely first; empty: not computed
};

/// Chart of another calibration of the same cell, relative to its own centre.
struct OtherChart {
  std::int64_t calibration = 0;  ///< its session
  double noise = 0.0;            ///< as in DriftChart; 0: no reference
  std::vector<DriftPoint> points = {};
};

struct DriftChart {
  std::size_t counted = 0;    ///< checks in the chart that held: its reference
  std::size_t least = 0;      ///< required number of them
  std::size_t undecided = 0;  ///< undecided checks since the newest decided one
  DriftState state = DriftState::kTooFew;
  DriftAdvice advice = DriftAdvice::kNone;
  ControlLimits warns, alarms;
  double noise = 1.0;  ///< scatter of the checks relative to the stated one
  std::optional<Eigen::Vector3d> per_kelvin_m = {};  ///< if temperatures are known
  std::vector<DriftPoint> points = {};               ///< oldest first
  std::optional<DriftTrend> trend = {};              ///< if it warns or alarms
  std::optional<std::int64_t> alarmed_at = {};       ///< the check that raised the current alarm
  std::optional<NotHeld> not_held = {};  ///< set if the newest decided check does not hold
  std::vector<OtherChart> others = {};   ///< oldest calibration first
  std::vector<DriftEvent> events =
      {};  ///< of the cell since the oldest of these charts, oldest first

  /// The newest check that held or did not; null if there is none.
  const CheckMeasurement* newest_decided() const;
};

/// Whether the calibration may be relied on.
enum class Holding {
  kHolds,
  kDoesNotHold,
  kUnknown,  ///< the newest check is undecided or contradicts the chart, or the evidence is too old
};

/// Statement on a calibration, and the newest evidence for it.
struct Standing {
  Holding holding = Holding::kUnknown;
  bool by_check = false;    ///< evidence: newest decided check; otherwise the calibration itself
  double evidence_s = 0.0;  ///< its time, since 1970, UTC
  double due_s = 0.0;       ///< the next check is due by then
};

/// Advice for a single check.
DriftAdvice remedy_of(CheckVerdict verdict, ChangeKind change);

constexpr const char* to_string(LeftOut why) { return own_name(why); }
constexpr const char* to_string(DriftState state) { return own_name(state); }
/// "re_measure_tcp"
constexpr const char* to_string(DriftAdvice advice) { return own_name(advice); }
constexpr const char* to_string(DriftShape shape) { return own_name(shape); }
constexpr const char* to_string(Holding holding) { return own_name(holding); }

// Sentences of a control chart: number first, then the remedy.

/// "in control: TCP 0.01 ± 0.04 mm (k=2) off the centre of 31 checks, 41 % of the alarm limit"
Phrase state_phrase(const DriftChart& chart);
/// "creep of 0.048 ± 0.010 mm/month (k=2) since check 41 (2026-03-01), ..."; empty without a trend.
Phrase trend_phrase(const DriftChart& chart);
/// State, trend, advice, what else is known, and the limits; one per line.
std::vector<Phrase> phrases(const DriftChart& chart);
/// The same in English.
std::vector<std::string> words(const DriftChart& chart);

/// "2026-03-01" for seconds since 1970, UTC.
std::string date_words(double time_s);

}  // namespace cellcal::calib
