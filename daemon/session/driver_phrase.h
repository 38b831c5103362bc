#pragma once
// Sentences of the drivers as phrases of the catalogues.

#include <utility>
#include <variant>
#include <vector>

#include "calib/words/phrase.h"
#include "drivers/sentence.h"

namespace cellcal::daemon {

inline calib::Phrase phrase_of(const drivers::Sentence& sentence) {
  const auto value_of = [](const auto& value) {
    if constexpr (std::is_same_v<decltype(value), const drivers::Sentence&>)
      return phrase_of(value);
    else
      return value;
  };
  std::vector<calib::PhraseValue> values;
  for (const drivers::SentenceValue& one : sentence.values)
    std::visit([&](const auto& value) { values.emplace_back(one.name, value_of(value)); },
               one.value);
  return {sentence.id, std::move(values)};
}

}  // namespace cellcal::daemon
