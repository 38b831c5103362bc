#pragma once
// The touch: the one struct in which a measurement travels from the session through the journal
// to the estimator, the report and the CSV. Nothing else represents a touch.

#include <cstddef>
#include <string>
#include <vector>

namespace cellcal::calib {

enum class TouchSet { kFit, kCheck };

struct Touch {
  std::vector<double> joint_rad;  ///< controller's axis angles at the instant of contact [rad]
  std::string target;             ///< id of the target in the cell file
  TouchSet set = TouchSet::kFit;  ///< check touches are held out of the fit
  double sigma_m = 0.0;           ///< 1 sigma of this touch; 0: the cell's
  double radius_m = 0.0;          ///< kind wire: this row's length
  double tracker_m[3] = {0.0, 0.0, 0.0};  ///< kind tracker: the tracker's reading
  std::string time;                       ///< ISO 8601 UTC; empty where unknown

  // Evidence of how it was measured. Not used by the estimator; empty or 0 where unknown.
  std::vector<double> settled_joint_rad;  ///< after the stop, arm at rest
  int readings = 0;                       ///< slow searches that agree
  double spread_m = 0.0;                  ///< largest distance along the search between them
  double speed_m_s = 0.0;                 ///< of the tip at contact
  int line = 0;                           ///< line of the file that it was read from; 0: none

  bool operator==(const Touch&) const = default;
};

/// "touch 12", counted from 1, and where it came out of a file "touch 12 (line 14)".
std::string touch_words(std::size_t index, const Touch& touch);

}  // namespace cellcal::calib
