#pragma once
// Phrases in JSON: what a program reads beside the words.

#include <nlohmann/json_fwd.hpp>

#include "calib/words/phrase.h"

namespace cellcal::calib {

/// A string without values, otherwise {"id": ID, "values": {"volts": 2.5}}; a value is a number or a phrase.
nlohmann::json to_json(const Phrase& phrase);
/// Their words, for a reader without the catalogues.
std::vector<std::string> all_words(const std::vector<Phrase>& phrases,
                                   const Language& language = {});
/// Throws std::invalid_argument for anything else, and where phrases nest deeper than kMostNested.
Phrase phrase_of(const nlohmann::json& value);
inline constexpr int kMostNested = 32;

}  // namespace cellcal::calib
