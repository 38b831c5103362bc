#pragma once
// A session's touches and, where it was identified, what came of it.

#include <cstddef>
#include <map>
#include <optional>
#include <string>

#include "calib/model/robot.h"
#include "calib/model/touch.h"
#include "calib/result/calibration.h"
#include "daemon/journal/journal.h"

namespace cellcal::daemon::web {

/// How far off its sphere or plane the calibrated tip is, signed, outwards [m]; nothing where the
/// calibration does not say. The latch's delay is undone where the calibration found one.
std::optional<double> residual_m(const calib::Calibration& calibration, const calib::Touch& touch);

/// What was known of a touch when it was made, before identification [m].
struct FigureOfTouch {
  std::optional<double> residual_m, u95_m;
};

/// `calibration`: null where there is none; then residuals are those of `made`, by number of the touch, without sign.
std::string figures_to_json(const SessionRecord& record, const calib::Cell& cell,
                            const std::vector<calib::Touch>& touches,
                            const calib::Calibration* calibration,
                            const std::map<std::size_t, FigureOfTouch>& made = {});

}  // namespace cellcal::daemon::web
