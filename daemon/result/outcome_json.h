#pragma once
// An outcome as JSON: "cellcal.outcome/1", millimetres and degrees. Used by the journal's column `outcome`
// and by `outcome` of the API (there with its words).

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

#include "daemon/result/outcome.h"

namespace cellcal::daemon {

std::string outcome_to_json(const SessionOutcome& outcome);
/// None for an empty text, or one of another version.
std::optional<SessionOutcome> outcome_from_json(const std::string& text);
/// With "good", "cause" and "words"; null where none is recorded.
nlohmann::json outcome_with_words(const std::optional<SessionOutcome>& outcome);

}  // namespace cellcal::daemon
