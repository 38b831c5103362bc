#pragma once
// Touches of a session and, where identified, its results.

#include <cstddef>
#include <map>
#include <optional>
#include <string>

#include "calib/model/robot.h"
#include "calib/model/touch.h"
#include "calib/result/calibration.h"
#include "daemon/journal/journal.h"

namespace cellcal::daemon::web {

/// Signed outward distance [m] of the calibrated tip from its sphere or plane; none where the calibration
/// does not contain the target. Corrected for the latch delay, if estimated.
std::optional<double> residual_m(const calib::Calibration& calibration, const calib::Touch& touch);

/// Values known when the touch was made, before identification [m].
struct FigureOfTouch {
  std::optional<double> residual_m, u95_m;
};

/// `calibration`: null without one; the residuals are then the unsigned ones of `made`, by touch number.
std::string figures_to_json(const SessionRecord& record, const calib::Cell& cell,
                            const std::vector<calib::Touch>& touches,
                            const calib::Calibration* calibration,
                            const std::map<std::size_t, FigureOfTouch>& made = {});

}  // namespace cellcal::daemon::web
