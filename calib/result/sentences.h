#pragma once
// Sentences of findings, without their openings, by subject; finding.cc combines them. First the accessors
// of evidence.

#include <functional>
#include <string>

#include "calib/result/finding.h"

namespace cellcal::calib::sentences {

/// Value by name, in its own unit; NaN if absent.
double of(const Finding& f, const char* name);
double sigma_of(const Finding& f, const char* name);
bool has(const Finding& f, const char* name);
/// True if present and not 0.
bool is_set(const Finding& f, const char* name);
bool is_one(const Finding& f, const char* name);

/// "touch 12 (line 14)", counted from 1.
std::string touch_of(const Subject& subject);
/// "S1-S2"
std::string length_of(const Finding& f);
/// "over the workspace"
const char* where(const Finding& f);
/// The first few parts; the rest is counted.
std::string list(const Finding& f, const std::function<std::string(const FindingPart&)>& one);
/// Remedy for a target whose touches do not fit.
const char* again(const Finding& f);
/// "0.40 +- 0.05 mm too long", from the required change of all readings.
std::string reading_off(const Quantity& longer);

// Touches, their noise and their distribution. (sentences_of_touches.cc, as the next section)

std::string touch_scatter(const Finding& f);
std::string duplicate_touches(const Finding& f);
std::string many_outliers(const Finding& f);
std::string outliers_of_target(const Finding& f);
std::string check_touches(const Finding& f);
std::string gross_check_touches(const Finding& f);
std::string no_check_touches(const Finding& f);
std::string unseen_not_judged(const Finding& f);
/// The reason alone.
std::string why_not_judged(const Finding& f);
std::string all_left_out(const Finding& f);
std::string unseen_place(const Finding& f);
std::string temperature(const Finding& f);
std::string model_error(const Finding& f);
std::string too_few_touches(const Finding& f);
std::string rank(const Finding& f);
std::string too_few_directions(const Finding& f);
std::string not_touched(const Finding& f);

// Statements of robot and cell file.

std::string certified_length(const Finding& f);
std::string certified_twice(const Finding& f);
std::string artefact_size(const Finding& f);
std::string stated_centre(const Finding& f);
std::string exchanged_centres(const Finding& f);
std::string negative_compliance(const Finding& f);
std::string arm_scale(const Finding& f);
std::string off_nominal(const Finding& f);
std::string effective_radius(const Finding& f);

// Use of the result, and the previous state.

std::string scale_by_lengths(const Finding& f);
std::string scale_by_readings(const Finding& f);
std::string scale_by_nothing(const Finding& f);
std::string scope_of_touches(const Finding& f);
std::string unchecked_readings(const Finding& f);
std::string unchecked_lengths(const Finding& f);
std::string unchecked_length(const Finding& f);
std::string unchecked_touch(const Finding& f);
std::string required(const Finding& f);
std::string no_gain(const Finding& f);
std::string gain(const Finding& f);
std::string controller_model(const Finding& f);
std::string changed(const Finding& f);
std::string change_accepted(const Finding& f);
std::string unchanged(const Finding& f);
std::string not_compared(const Finding& f);

// Changes during a session.

std::string moved_target(const Finding& f);
std::string jumped(const Finding& f);

// Updates: the change since the last calibration, or the reason for a full session.

std::string updated(const Finding& f);
std::string update_not_needed(const Finding& f);
std::string update_contradicted(const Finding& f);
std::string update_not_resolved(const Finding& f);
std::string update_not_found(const Finding& f);
std::string update_too_few(const Finding& f);

}  // namespace cellcal::calib::sentences
