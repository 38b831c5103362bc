#pragma once
// Sentences of findings, without their openings, where they depend on more than the kind; finding.cc has the
// others. Values of a sentence: the evidence by name, "NAME_sigma", "name", "other", "touch", "text".

#include <functional>
#include <string>
#include <vector>

#include "calib/result/finding.h"
#include "calib/words/phrase.h"

namespace cellcal::calib::sentences {

/// Value by name, in its own unit; NaN if absent.
double of(const Finding& f, const char* name);
bool has(const Finding& f, const char* name);
/// True if present and not 0.
bool is_set(const Finding& f, const char* name);
bool is_one(const Finding& f, const char* name);

/// With all values of the finding, or of its part, and further ones.
Phrase said(std::string id, const Finding& f, std::vector<PhraseValue> more = {});
Phrase said(std::string id, const FindingPart& part, std::vector<PhraseValue> more = {});

/// "touch 12 (line 14)", counted from 1. `evidence`: with a "rank", "touch 3 in time (row 12, line 14)".
Phrase touch_of(const Subject& subject, const std::vector<Quantity>& evidence = {});
/// The first few parts; the rest is counted.
Phrase list(const Finding& f, const std::function<Phrase(const FindingPart&)>& one);
/// All parts.
Phrase all_parts(const Finding& f, const char* separator,
                 const std::function<Phrase(const FindingPart&)>& one);
Phrase name_of(const FindingPart& part);
/// "0.40 ± 0.05 mm too long", from the required change of all readings.
Phrase reading_off(const Quantity& longer);

// Touches, their noise and their distribution; statements of robot and cell file. (sentences_of_touches.cc)

Phrase touch_scatter(const Finding& f);
Phrase duplicate_touches(const Finding& f);
Phrase outliers_of_target(const Finding& f);
Phrase check_touches(const Finding& f);
Phrase gross_check_touches(const Finding& f);
Phrase unseen_not_judged(const Finding& f);
/// The reason alone.
Phrase why_not_judged(const Finding& f);
Phrase all_left_out(const Finding& f);
Phrase model_error(const Finding& f);
Phrase too_few_touches(const Finding& f);
Phrase too_few_directions(const Finding& f);
Phrase not_touched(const Finding& f);
Phrase scope_of_touches(const Finding& f);
Phrase certified_length(const Finding& f);
Phrase artefact_size(const Finding& f);
Phrase stated_centre(const Finding& f);
Phrase exchanged_centres(const Finding& f);
Phrase off_nominal(const Finding& f);
Phrase effective_radius(const Finding& f);

/// Of a likely cause (likely_cause.cc).
Phrase cause(const Finding& f);

// Use of the result, the previous state, changes during a session, updates.

Phrase scale_by_lengths(const Finding& f);
Phrase scale_by_readings(const Finding& f);
Phrase scale_by_nothing(const Finding& f);
Phrase required(const Finding& f);
Phrase no_gain(const Finding& f);
Phrase gain(const Finding& f);
Phrase changed(const Finding& f);
Phrase change_accepted(const Finding& f);
Phrase unchanged(const Finding& f);
Phrase moved_target(const Finding& f);
Phrase jumped(const Finding& f);
Phrase updated(const Finding& f);
Phrase update_not_needed(const Finding& f);
Phrase update_contradicted(const Finding& f);
Phrase update_not_resolved(const Finding& f);
Phrase update_not_found(const Finding& f);

}  // namespace cellcal::calib::sentences
