#pragma once
// What a person reads of a result.

#include <optional>
#include <span>
#include <string>

#include "calib/model/touch.h"
#include "calib/result/calibration.h"

namespace cellcal::daemon {

enum class Detail {
  kSummary,  ///< about ten lines
  kAll       ///< chi^2, noise, observability, correlations, each outlier, what was found besides
};

/// How late the latched angles are, by fast against slow contacts alone.
struct ContactsDelay {
  double delay_s = 0.0, sigma_s = 0.0;
  int touches = 0;
};

/// The latch's delay in one line, U with k = 2: by the fit where its touches tell it, by the contacts where they were
/// compared, and whether both are one. Empty where neither says anything.
std::string delay_words(const calib::Calibration* fit,
                        const std::optional<ContactsDelay>& contacts);

/// Residuals before and after, predicted accuracy, outliers, and the verdict with what withholds the
/// result or has to be looked at. Ends with a line break. `touches`: those of the calibration, where
/// they are known, so that outliers can be found in their file.
std::string result_words(const calib::Calibration& calibration,
                         std::span<const calib::Touch> touches = {},
                         Detail detail = Detail::kSummary,
                         const std::optional<ContactsDelay>& contacts = {});

}  // namespace cellcal::daemon
