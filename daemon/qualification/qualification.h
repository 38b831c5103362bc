#pragma once
// How good the contacts of a cell are, before its first calibration: noise, overtravel, latch delay.
//
// Few places of one sphere, each touched several times; each touch is one search at one of several
// speeds and slow searches behind it, along the same line. Depths of one line differ by noise and by
// speed times delay, whatever is wrong with the arm.
//
//   delay  t = median over touches of (d_fast - mean d_slow) / (v_fast - v_slow)
//   noise  of one contact: sum over places of (d - v t - mean of the place)^2 / dof, one contact per
//          touch, as sessions make them; so the arm's own repeatability is in it
//
// Assumption: the arm stands still between the visits of a place (a minute). Failure case: a tip that
// is loose or dirty; then the noise is large, which is what this is for.

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "calib/plan/plan.h"
#include "daemon/qualification/contact_delay.h"
#include "daemon/session/action.h"

namespace cellcal::daemon {

/// Places and visits of a qualification, and the share of [motion] fast_search_mm_s that each visit's
/// search has.
inline constexpr int kQualificationPlaces = 6;
inline constexpr double kQualificationShares[] = {1.0, 0.5, 1.0};

/// What the cell file and the configuration state, to be compared with.
struct StatedContact {
  double touch_sigma_m = 0.0;
  double delay_s = 0.0, delay_sigma_s = 0.0;
  double radius_offset_sigma_m = 0.0;
};

/// A figure with its 1 sigma.
struct Figure {
  double value = 0.0, sigma = 0.0;
};

/// All searches of one speed.
struct Overtravel {
  double speed_m_s = 0.0;
  int searches = 0;
  /// Tip travel from the contact to rest; each differs from the true one by the contact's noise.
  double median_m = 0.0, worst_m = 0.0;
};

enum class QualificationFinding {
  kNoiseAboveStated,
  kOvertravelTooLong,
  kDelayNotAsStated,
  kRadiusNotAsStated,
};
const char* to_string(QualificationFinding finding);
/// Of a name that is none, nothing.
std::optional<QualificationFinding> qualification_finding(const std::string& name);

struct Qualification {
  std::string target;
  int touches = 0, places = 0;
  std::optional<Figure>
      noise_m;  ///< 1 sigma of one touch; none with less than two visits of a place
  int noise_dof = 0;
  std::optional<ContactDelay> delay;
  std::vector<Overtravel> overtravel;  ///< by speed, fastest first
  double reaction_worst_s = 0.0;       ///< contact to stop command
  int bounces_worst = 0;
  /// Effective minus stated radius, from the estimate; none where the touches hardly know more than
  /// the prior, as of one sphere with an arm of which nothing is known yet.
  std::optional<Figure> radius_offset_m;
  StatedContact stated;
  std::vector<QualificationFinding> findings;  ///< what is not as it should be; empty: all is well

  bool passed() const { return findings.empty() && noise_m && delay; }
};

/// Longest overtravel, at the median, that does no harm to tip and sphere.
inline constexpr double kOvertravelLimitM = 0.3e-3;

/// `readings`: all of the session, as they were made; those of touches that are not in `plan` are left
/// aside. `touches_are_slow`: sessions of this cell confirm every touch, so the mean of the slow contacts
/// is what scatters. `slow_m_s`: of the searches that confirm; `fast_m_s`: of those without a speed of their own.
Qualification qualify(const calib::Plan& plan, std::span<const RecordReading> readings,
                      double fast_m_s, double slow_m_s, const StatedContact& stated,
                      std::optional<Figure> radius_offset_m = {}, bool touches_are_slow = false);

/// One line each, number first; what is wrong behind them, each with what to do.
std::vector<std::string> in_words(const Qualification& qualification);

}  // namespace cellcal::daemon
