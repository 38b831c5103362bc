#pragma once
// Publication of touches: each once, when it is on disk and its residual is known, at the latest when the
// next touch is made or the session ends.

#include <array>
#include <memory>
#include <optional>
#include <vector>

#include "calib/model/robot.h"
#include "daemon/service/status.h"
#include "daemon/session/state.h"

namespace cellcal::calib {
class ArmModel;
}

namespace cellcal::daemon {

/// TCP of the touch by the nominal model [m, base frame]; none where its joint count differs from the arm's.
std::optional<std::array<double, 3>> nominal_tip(const calib::ArmModel& arm,
                                                 const calib::Touch& touch);

class TouchPublication {
 public:
  TouchPublication() = default;
  /// `known`: number of touches of the session published before.
  TouchPublication(std::int64_t session, const calib::Cell& cell, std::size_t known);

  /// The touch to publish now, or null. At most one per call: to be called after every step.
  std::shared_ptr<const MadeTouch> look(const State& state,
                                        const std::vector<calib::Touch>& touches);

 private:
  std::int64_t session_ = 0;
  std::shared_ptr<const calib::ArmModel> arm_;
  std::size_t published_ = 0;
};

}  // namespace cellcal::daemon
