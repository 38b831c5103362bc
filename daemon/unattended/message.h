#pragma once
// A notice as text for operators, and as JSON for programs (format "cellcal.notice/1").

#include <string>

#include "daemon/config/unattended_config.h"
#include "daemon/session/failure.h"
#include "daemon/unattended/notice.h"

namespace cellcal::daemon {

struct Message {
  std::string subject;  ///< one line
  std::string body;     ///< lines
  std::string json;     ///< with subject and body
};

/// `host`: name of this computer.
Message compose(const Notice& notice, Language language, const std::string& host);

// Sentences of messages, in each language. Descriptions and remedies of failures are taken from the page's
// catalogue (daemon/web/src/words).

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
