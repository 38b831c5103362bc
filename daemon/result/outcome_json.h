#pragma once
// Result and outcome of a session as documents, in millimetres and degrees: the journal's columns `document` and `outcome`
// ("cellcal.outcome/1"), and the `outcome` of the API (there with its words).

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

#include "daemon/result/outcome.h"

namespace cellcal::daemon {

/// "cellcal.check/1", "cellcal.qualification/1" (milliseconds as well) or "cellcal.found/1"; empty for other kinds.
std::string document_of(const SessionResult& result);
std::string outcome_to_json(const SessionOutcome& outcome);
/// None for an empty text, or one of another version.
std::optional<SessionOutcome> outcome_from_json(const std::string& text);
/// With "good", "cause" and "words"; null where none is recorded.
nlohmann::json outcome_with_words(const std::optional<SessionOutcome>& outcome,
                                  const calib::Language& language = {});

}  // namespace cellcal::daemon
