#pragma once
// The sentences of messages, in each language. What a failure is and what to do about it stands in the page's
// catalogue (daemon/web/src/words) and is taken from there.

#include <string>

#include "daemon/config/notify_config.h"
#include "daemon/session/failure.h"

namespace cellcal::daemon {

enum class Text {
  kDone,
  kWithheld,
  kDrifted,
  kUndecided,
  kRecovered,
  kFailed,
  kAborted,
  kNotBegun,
  kDoWithheld,
  kDoDrifted,
  kDoUndecided,
  kDoAborted,
  kDoNotBegun,
  kCell,
  kKind,
  kTouches,
  kTime,
  kErrorNear,
  kErrorOver,
  kFinding,
  kEvidence,
  kReport,
  kSender
};
inline constexpr int kTexts = static_cast<int>(Text::kSender) + 1;

/// With {} where something is put in.
const char* text(Language language, Text which);
/// One sentence each; empty where the page's catalogue lacks it, which a test forbids.
std::string what_happened(Language language, FailureKind kind);
std::string what_to_do(Language language, FailureKind kind);

}  // namespace cellcal::daemon
