#pragma once
// Result of a session: one value per kind. The session passes it through unread; tasks create it and write
// its files, the journal stores its outcome (outcome.h).

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "calib/result/calibration.h"
#include "calib/result/tcp_check.h"
#include "daemon/qualification/qualification.h"

namespace cellcal::daemon {

struct FoundSphere {
  std::string target;
  Eigen::Vector3d centre_m = Eigen::Vector3d::Zero();  ///< base frame of the nominal arm
  double u_m = 0.0;                                    ///< U(k=2) of each component
  int touches = 0;
  /// From the centre in the cell file; none where the file has none.
  std::optional<double> moved_m;
};
struct FoundSpheres {
  std::vector<FoundSphere> spheres;
};

/// Completed from stand-off to stand-off without contact.
struct DryRun {
  std::size_t standoffs = 0;
};

/// A struct, so that a session's state can hold it as an incomplete type. An update is a calibration with
/// `calibration.update`.
struct SessionResult {
  std::variant<calib::Calibration, calib::TcpCheck, Qualification, FoundSpheres, DryRun> of;

  /// Null: another kind.
  const calib::Calibration* calibration() const { return std::get_if<calib::Calibration>(&of); }
};

}  // namespace cellcal::daemon
