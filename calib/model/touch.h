#pragma once
// The touch: the one struct in which a measurement travels from the session through the journal
// to the estimator, the report and the CSV. Nothing else represents a touch.

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

namespace cellcal::calib {

enum class TouchSet { kFit, kCheck };
/// As files and interfaces name it: "fit", "check".
const char* to_string(TouchSet set);

struct Touch {
  std::vector<double> joint_rad;  ///< controller's axis angles at the instant of contact [rad]
  std::string target;             ///< id of the target in the cell file
  std::string tool;               ///< id of the tool whose tip it was; empty: the cell's first
  TouchSet set = TouchSet::kFit;  ///< check touches are held out of the fit
  double sigma_m = 0.0;           ///< 1 sigma of this touch; 0: the cell's
  double radius_m = 0.0;          ///< kind wire: this row's length
  double tracker_m[3] = {0.0, 0.0, 0.0};  ///< kind tracker: the tracker's reading
  /// Kind tracker, where it measured a pose: A, B, C of the probe in the tracker's frame, as a file
  /// states them; and their 1 sigma, 0: the cell's.
  std::optional<std::array<double, 3>> tracker_abc_rad;
  double turn_sigma_rad = 0.0;
  double speed_m_s = 0.0;  ///< of the tip at contact; 0: unknown. A late latch reads it deeper
  /// Where the tip was going, unit, base frame; where nothing is stated, straight into the surface.
  std::optional<std::array<double, 3>> approach;
  std::string time;  ///< ISO 8601; empty where unknown

  // Evidence of how it was measured. Not used by the estimator; empty or 0 where unknown.
  std::vector<double> settled_joint_rad;  ///< after the stop, arm at rest
  int readings = 0;                       ///< slow searches that agree
  double spread_m = 0.0;                  ///< largest distance along the search between them
  std::optional<double> temperature_c;    ///< of the cell, as stated
  int line = 0;                           ///< line of the file that it was read from; 0: none

  bool operator==(const Touch&) const = default;
};

/// All that was read of a touch. Refers to it.
inline auto reading(const Touch& touch) {
  return std::tie(touch.joint_rad, touch.radius_m, touch.tracker_m[0], touch.tracker_m[1],
                  touch.tracker_m[2], touch.tracker_abc_rad);
}

/// "touch 12", counted from 1, and where it came out of a file "touch 12 (line 14)".
std::string touch_words(std::size_t index, const Touch& touch);

}  // namespace cellcal::calib
