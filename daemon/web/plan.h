#pragma once
// The touches that are to be made.

#include <cstdint>
#include <string>

#include "calib/plan/planned_touch.h"

namespace cellcal::daemon::web {

/// `first`: number of the plan's first touch in its session. The tip is where the contact is
/// expected, the joints are those of the stand-off.
std::string plan_to_json(std::int64_t session, std::size_t first, const calib::Plan& plan,
                         const calib::Cell& cell);

}  // namespace cellcal::daemon::web
