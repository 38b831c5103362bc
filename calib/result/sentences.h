#pragma once
// The sentences of findings, without their openings, by what they are about; finding_words.h puts them
// together. First what reads evidence. (evidence.cc)

#include <functional>
#include <string>

#include "calib/result/finding.h"

namespace cellcal::calib::sentences {

/// Of that name, in its own unit; not a number where there is none.
double of(const Finding& f, const char* name);
double sigma_of(const Finding& f, const char* name);
bool has(const Finding& f, const char* name);
/// It is there, and not 0.
bool is_set(const Finding& f, const char* name);
bool is_one(const Finding& f, const char* name);

/// "touch 12 (line 14)", counted from 1.
std::string touch_of(const Subject& subject);
/// "S1-S2"
std::string length_of(const Finding& f);
/// "over the workspace"
const char* where(const Finding& f);
/// The first few parts; of the others how many they are.
std::string list(const Finding& f, const std::function<std::string(const FindingPart&)>& one);
/// What to do about a target whose touches do not fit.
const char* again(const Finding& f);
/// "0.40 +- 0.05 mm too long", of how much longer all readings had to be.
std::string reading_off(const Quantity& longer);

// What findings say of the touches, their noise and where they are. (sentences_of_touches.cc)

std::string touch_scatter(const Finding& f);
std::string duplicate_touches(const Finding& f);
std::string many_outliers(const Finding& f);
std::string outliers_of_target(const Finding& f);
std::string check_touches(const Finding& f);
std::string gross_check_touches(const Finding& f);
std::string no_check_touches(const Finding& f);
std::string unseen_not_judged(const Finding& f);
/// Its reason alone.
std::string why_not_judged(const Finding& f);
std::string all_left_out(const Finding& f);
std::string unseen_place(const Finding& f);
std::string temperature(const Finding& f);
std::string model_error(const Finding& f);
std::string too_few_touches(const Finding& f);
std::string rank(const Finding& f);
std::string too_few_directions(const Finding& f);
std::string not_touched(const Finding& f);

// What findings say of what robot and cell file state. (sentences_of_files.cc)

std::string certified_length(const Finding& f);
std::string certified_twice(const Finding& f);
std::string artefact_size(const Finding& f);
std::string stated_centre(const Finding& f);
std::string exchanged_centres(const Finding& f);
std::string negative_compliance(const Finding& f);
std::string arm_scale(const Finding& f);
std::string off_nominal(const Finding& f);
std::string effective_radius(const Finding& f);

// What findings say of what the result is good for, and of what it was before. (sentences_of_use.cc)

std::string scale_by_lengths(const Finding& f);
std::string scale_by_readings(const Finding& f);
std::string scale_by_nothing(const Finding& f);
std::string unchecked_readings(const Finding& f);
std::string unchecked_lengths(const Finding& f);
std::string unchecked_length(const Finding& f);
std::string unchecked_touch(const Finding& f);
std::string required(const Finding& f);
std::string no_gain(const Finding& f);
std::string gain(const Finding& f);
std::string changed(const Finding& f);
std::string change_accepted(const Finding& f);
std::string unchanged(const Finding& f);
std::string not_compared(const Finding& f);

// What findings say of what moved or jumped in mid-session. (sentences_of_changes.cc)

std::string moved_target(const Finding& f);
std::string jumped(const Finding& f);

// What findings say of an update: what changed since the last calibration, or why it takes a full session.
// (sentences_of_updates.cc)

std::string updated(const Finding& f);
std::string update_not_needed(const Finding& f);
std::string update_contradicted(const Finding& f);
std::string update_not_resolved(const Finding& f);
std::string update_not_found(const Finding& f);
std::string update_too_few(const Finding& f);

}  // namespace cellcal::calib::sentences
