#pragma once
// Sentences of messages, in each language. Descriptions and remedies of failures are taken from the page's
// catalogue (daemon/web/src/words).

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

/// With {} as placeholders.
const char* text(Language language, Text which);
/// One sentence each; empty where the page's catalogue lacks it, which a test excludes.
std::string what_happened(Language language, FailureKind kind);
std::string what_to_do(Language language, FailureKind kind);

}  // namespace cellcal::daemon
