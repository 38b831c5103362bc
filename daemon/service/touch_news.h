#pragma once
// When a touch is published: once, when it is on disk and its residual is known. It does not wait
// for that longer than until the next touch is made, or the session ends.

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

/// TCP of the touch by the nominal model [m, base frame]; none where it has other joints than the arm.
std::optional<std::array<double, 3>> nominal_tip(const calib::ArmModel& arm,
                                                 const calib::Touch& touch);

class TouchNews {
 public:
  TouchNews() = default;
  /// `known`: touches of the session that were published before.
  TouchNews(std::int64_t session, const calib::Cell& cell, std::size_t known);

  /// The touch that is to be published now, or null. At most one: call it after every step.
  std::shared_ptr<const MadeTouch> look(const State& state,
                                        const std::vector<calib::Touch>& touches);

 private:
  std::int64_t session_ = 0;
  std::shared_ptr<const calib::ArmModel> arm_;
  std::size_t published_ = 0;
};

}  // namespace cellcal::daemon
