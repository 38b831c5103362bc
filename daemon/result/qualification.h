#pragma once
// Qualification of a cell's contacts before its first calibration: noise, overtravel, latch delay.
//
// A few places of one sphere are touched several times; each touch is one search at one of several speeds
// followed by slow searches along the same line. Depths on one line differ by noise and by speed times delay,
// independent of errors of the arm.
//
//   delay  t = median over touches of (d_fast - mean d_slow) / (v_fast - v_slow)
//   noise  of one contact: sum over places of (d - v t - mean of the place)^2 / dof, one contact per
//          touch, as in sessions; it includes the arm's repeatability
//
// Assumption: the arm does not drift between the visits of a place (a minute). Failure case: a loose or dirty
// tip; the noise is then large, which is the purpose of the test.

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "calib/model/enum_table.h"
#include "calib/plan/plan.h"
#include "calib/words/phrase.h"
#include "daemon/result/contact_delay.h"
#include "daemon/session/action.h"

namespace cellcal::daemon {

/// Places and visits of a qualification, with the share of [motion] fast_search_mm_s of each visit's search.
inline constexpr int kQualificationPlaces = 6;
inline constexpr double kQualificationShares[] = {1.0, 0.5, 1.0};

/// Values stated by cell file and configuration, for comparison.
struct StatedContact {
  double touch_sigma_m = 0.0;
  double delay_s = 0.0, delay_sigma_s = 0.0;
  double radius_offset_sigma_m = 0.0;
};

/// A value with 1 sigma.
struct Figure {
  double value = 0.0, sigma = 0.0;
};

/// All searches of one speed.
struct Overtravel {
  double speed_m_s = 0.0;
  int searches = 0;
  /// Tip travel from the contact to rest; each value includes the contact's noise.
  double median_m = 0.0, worst_m = 0.0;
};

enum class QualificationFinding {
  kNoiseAboveStated,
  kOvertravelTooLong,
  kDelayNotAsStated,
  kRadiusNotAsStated,
};
/// "delay-not-as-stated"
constexpr const char* to_string(QualificationFinding finding) { return own_name<'-'>(finding); }
/// None for an unknown name.
constexpr std::optional<QualificationFinding> qualification_finding(std::string_view name) {
  return by_own_name<QualificationFinding, '-'>(name);
}

struct Qualification {
  std::string target;
  int touches = 0, places = 0;
  /// 1 sigma of one touch; none with fewer than two visits of a place.
  std::optional<Figure> noise_m;
  int noise_dof = 0;
  std::optional<ContactDelay> delay;
  std::vector<Overtravel> overtravel;  ///< by speed, fastest first
  double reaction_worst_s = 0.0;       ///< contact to stop command
  int bounces_worst = 0;
  /// Effective minus stated radius, from the estimate; none where the touches add little to the prior, as for
  /// one sphere with an uncalibrated arm.
  std::optional<Figure> radius_offset_m;
  StatedContact stated;
  std::vector<QualificationFinding> findings;  ///< deviations from the expected; empty: none

  bool passed() const { return findings.empty() && noise_m && delay; }
};

/// Largest median overtravel that is harmless to tip and sphere.
inline constexpr double kOvertravelLimitM = 0.3e-3;

/// `readings`: all of the session, in order; those of touches not in `plan` are skipped. `touches_are_slow`:
/// sessions of this cell confirm every touch, so the mean of the slow contacts scatters. `slow_m_s`: speed of
/// the confirming searches; `fast_m_s`: of those without a speed of their own.
Qualification qualify(const calib::Plan& plan, std::span<const RecordReading> readings,
                      double fast_m_s, double slow_m_s, const StatedContact& stated,
                      std::optional<Figure> radius_offset_m = {}, bool touches_are_slow = false);

/// One line each, number first, followed by the findings with their remedies.
std::vector<calib::Phrase> phrases(const Qualification& qualification);

}  // namespace cellcal::daemon
