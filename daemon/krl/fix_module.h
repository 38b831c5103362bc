#pragma once
// CELLCAL_FIX: a KRL module that corrects points while the program runs (templates/cellcal_fix.src.in).
//
// The .src is the same for every arm but for the calibration's id and external axes; the .dat has the numbers. It computes the
// calibrated arm in REAL of 32 bits with the controller's INVERSE, FORWARD and geometric operator, and holds the arm
// where its robot, tool, base or calibration are others, or a correction is larger than any of this arm.

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "calib/result/calibration.h"
#include "daemon/krl/krl_data.h"

namespace cellcal::daemon::krl {

struct FixModuleOptions {
  int serial = 0;                  ///< $KR_SERIALNO of the robot
  std::string calibration_sha256;  ///< of its file, in hexadecimal digits
  bool anywhere = false;           ///< also at angles of a positioner that nothing was touched at
};

/// A tool that the module corrects with.
struct FixTool {
  calib::FrameMmDeg stated;      ///< $TOOL, within kSameToolMm and kSameToolDeg
  std::optional<LoadData> load;  ///< LOAD_DATA; none: any, borne as the cell file's tool
  bool by_load = false;          ///< another one has this $TOOL: $LOAD distinguishes them
  bool cells = false;  ///< the cell file's, with its bending; otherwise stiff and as stated
  Eigen::Isometry3d tip = Eigen::Isometry3d::Identity();  ///< identified, in the flange
  double bend_m_per_accel = 0.0, turn_rad_per_accel = 0.0;
  double mass_kg = 0.0;  ///< of everything on the flange
  Eigen::Vector3d com_m = Eigen::Vector3d::Zero();
  std::vector<double> play_closes_nm;  ///< per joint

  bool is(const calib::FrameMmDeg& tool) const;  ///< as `stated`
};

struct FixModule {
  KrlFile src, dat;
  std::vector<FixTool> tools;
  double most_mm = 0.0, most_deg = 0.0;  ///< beyond these a correction holds the arm
  /// Error of the tip by straight lines between the values of the joints' functions and slow harmonics.
  double table_mm = 0.0;
};

/// `data`: tools, loads and external axes of the controller. Throws FileError for an arm without six joints and a closed
/// form, for machine data of another linear unit, and for a number that a REAL cannot hold.
FixModule fix_module(const calib::Calibration& calibration, const Data& data,
                     const FixModuleOptions& options);

}  // namespace cellcal::daemon::krl
