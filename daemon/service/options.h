#pragma once
// What a session was asked to do. Stored with it as JSON, so that it can be planned again.

#include <string>
#include <string_view>

#include "calib/plan/touch_sequence.h"
#include "daemon/session/touch_policy.h"

namespace cellcal::daemon {

struct SessionOptions {
  calib::PlanOptions plan;
  std::string region = "workspace";  ///< as `cellcal plan --region` takes it
  /// Touches are chosen one by one until the goal is reached; else `plan` is made beforehand.
  bool one_by_one = false;
  calib::Goal goal;
  bool find = false;           ///< all spheres are found by touching first
  bool accept_change = false;  ///< the arm may be another since its last calibration
  TouchPolicy touch;
};

std::string options_to_json(const SessionOptions& options);
/// Throws std::runtime_error naming the key.
SessionOptions options_from_json(std::string_view json);

}  // namespace cellcal::daemon
