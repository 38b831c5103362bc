#pragma once
// Sentences of the drivers in English.

#include <string>

#include "calib/words/phrase.h"
#include "daemon/session/driver_phrase.h"

namespace cellcal::drivers {

inline std::string said(const Sentence& sentence) {
  return calib::words(daemon::phrase_of(sentence));
}

}  // namespace cellcal::drivers
