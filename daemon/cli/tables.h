#pragma once
// Human-readable results.

#include <optional>
#include <span>
#include <string>

#include "calib/model/touch.h"
#include "calib/result/calibration.h"

namespace cellcal::daemon {

enum class Detail {
  kSummary,  ///< about ten lines
  kAll       ///< chi^2, noise, observability, correlations, outliers and other findings
};

/// Delay of the latched angles, from fast and slow contacts only.
struct ContactsDelay {
  double delay_s = 0.0, sigma_s = 0.0;
  int touches = 0;
};

/// Latch delay in one line, U with k = 2: from the fit where its touches determine it, from the contacts
/// where they were compared, and the agreement of both. Empty without either.
std::string delay_words(const calib::Calibration* fit,
                        const std::optional<ContactsDelay>& contacts);

/// Residuals before and after, predicted accuracy, outliers, and the verdict with its reasons. Ends with a
/// line break. `touches`: those of the calibration, if known, to locate outliers in their file.
std::string result_words(const calib::Calibration& calibration,
                         std::span<const calib::Touch> touches = {},
                         Detail detail = Detail::kSummary,
                         const std::optional<ContactsDelay>& contacts = {});

}  // namespace cellcal::daemon
