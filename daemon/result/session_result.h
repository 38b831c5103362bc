#pragma once
// What comes of a session: one value per kind. The session carries it unread; tasks make it and write its files, the
// journal keeps its outcome (outcome.h).

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
  std::optional<double> moved_m;  ///< from the cell file's centre; none there
};
struct FoundSpheres {
  std::vector<FoundSphere> spheres;
};

/// Went from stand-off to stand-off and met nothing.
struct DryRun {
  std::size_t standoffs = 0;
};

/// A struct, so that a session's state can hold one that it does not know. An update is a calibration with
/// `calibration.update`.
struct SessionResult {
  std::variant<calib::Calibration, calib::TcpCheck, Qualification, FoundSpheres, DryRun> of;

  /// Null: of another kind.
  const calib::Calibration* calibration() const { return std::get_if<calib::Calibration>(&of); }
};

}  // namespace cellcal::daemon
