#pragma once
// Lines of CELLCAL_FIX's .dat.

#include <Eigen/Geometry>
#include <algorithm>
#include <string>
#include <vector>

#include "calib/model/units.h"
#include "calib/result/calibration.h"
#include "daemon/krl/carriers.h"

namespace cellcal::daemon::krl {

/// A REAL's digits. Throws FileError where it holds none.
std::string real(double value);
/// Text of a FRAME; of a vector without rotation.
std::string frame(const calib::FrameMmDeg& f);
std::string frame(const Eigen::Isometry3d& f);
std::string frame(const Eigen::Vector3d& mm);
inline std::string truth(bool value) { return value ? "TRUE" : "FALSE"; }

class Lines {
 public:
  void comment(const std::string& words) { text_ += ";" + words + "\r\n"; }
  void line(const std::string& text) { text_ += text + "\r\n"; }
  void value(const std::string& type, const std::string& name, const std::string& value);
  void blank(const std::string& type, const std::string& names);
  /// An array, of one element where there is none.
  void array(const std::string& type, const std::string& name,
             const std::vector<std::string>& values, const std::string& none);
  /// The text `one` of each.
  template <typename All, typename One>
  void each(const std::string& type, const std::string& name, const All& all, const One& one,
            const std::string& none = {}) {
    std::vector<std::string> values;
    for (const auto& its : all) values.push_back(one(its));
    array(type, name, values, none);
  }
  template <typename All, typename One>
  void reals(const std::string& name, const All& all, const One& one) {
    each(
        "REAL", name, all, [&](const auto& its) { return real(one(its)); }, "0.0");
  }
  const std::string& text() const { return text_; }

 private:
  std::string text_;
};

// External axes in CELLCAL_FIX: numbers of templates/cellcal_fix_external.src.in, the calibration's linear unit and
// positioner.

/// Of the linear unit, then of the positioner: "E1" to "E6". Throws FileError for an axis of a positioner with another
/// name.
std::vector<std::string> external_names(const calib::Robot& robot);

/// `anywhere`: a positioner also at angles that nothing was touched at. Throws FileError where the machine data are of
/// another linear unit, or have one kinematic as drawn and another one as found.
void write_external(const calib::Calibration& calibration, const Carriers& carriers, bool anywhere,
                    Lines& out);

}  // namespace cellcal::daemon::krl
