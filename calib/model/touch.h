#pragma once
// The touch: the only representation of a measurement, from the session through the journal to the
// estimator, the report and the CSV.

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "calib/model/enum_table.h"

namespace cellcal::calib {

class ArmModel;
struct PreparedPose;
struct Target;

enum class TouchSet { kFit, kCheck };
/// Sufficient for a calibration of most cells.
inline constexpr int kUsualTouches = 100, kUsualChecks = 10;
/// Name in files and interfaces: "fit", "check".
constexpr const char* to_string(TouchSet set) { return own_name(set); }

struct Touch {
  /// Controller's axis angles at the instant of contact [rad]; position of a linear unit [m].
  std::vector<double> joint_rad;
  /// Angles of all of the positioner's axes, base outwards; empty without one.
  std::vector<double> positioner_rad;
  std::string target;                     ///< id of the target in the cell file
  std::string tool;                       ///< id of the tool that touched; empty: the cell's first
  std::string load;                       ///< id of the load held; empty: none
  TouchSet set = TouchSet::kFit;          ///< check touches are held out of the fit
  double sigma_m = 0.0;                   ///< 1 sigma of this touch; 0: the cell's
  double radius_m = 0.0;                  ///< kind wire: this row's length
  double tracker_m[3] = {0.0, 0.0, 0.0};  ///< kind tracker: the tracker's reading
  /// Kind tracker with a measured pose: A, B, C of the probe in the tracker's frame, as stated in
  /// the file; and their 1 sigma, 0: the cell's.
  std::optional<std::array<double, 3>> tracker_abc_rad;
  double turn_sigma_rad = 0.0;
  double speed_m_s = 0.0;  ///< of the tip at contact; 0: unknown. The latch delay reads it deeper
  /// Direction of the tip's motion, unit, base frame; default: normal to the surface.
  std::optional<std::array<double, 3>> approach;
  std::string time;  ///< ISO 8601; empty if unknown

  // Details of the measurement. Not used by the estimator; empty or 0 if unknown.
  std::vector<double> settled_joint_rad;  ///< after the stop, at rest
  int readings = 0;                       ///< slow searches that agree, or readings averaged
  double spread_m = 0.0;                  ///< largest distance along the search between them
  std::optional<double> temperature_c;    ///< of the cell, as stated
  int line = 0;                           ///< line of the source file; 0: none

  bool operator==(const Touch&) const = default;
};

/// True if the rows' numbers differ by at most half the last digit of the coarser row, of 0.01 deg and
/// 0.01 mm at most: one touch, copied.
bool same_reading(const Touch& a, const Touch& b);
/// True if all joint angles are multiples of `step_deg`.
bool is_rounded(const Touch& touch, double step_deg);

/// Angles of the axes that carry the touched target; empty for one on the floor. Refers to the touch.
/// Throws std::invalid_argument for a touch that does not state them.
std::span<const double> carrier_rad(const Touch& touch, const Target& target);
/// Likewise of the axes after them.
std::span<const double> outer_rad(const Touch& touch, const Target& target);
/// Of the tool that touched, under the touch's load, in the frame that carries the target. Throws std::out_of_range for
/// a tool or load that the arm does not have, and as carrier_rad() and ArmModel::prepare().
PreparedPose pose_of(const ArmModel& arm, const Touch& touch, const Target& target);

/// "touch 12", counted from 1, and "touch 12 (line 14)" for a touch from a file.
std::string touch_words(std::size_t index, const Touch& touch);

}  // namespace cellcal::calib
