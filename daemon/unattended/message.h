#pragma once
// A notice as text for operators, and as JSON for programs (format "cellcal.notice/1").

#include <string>

#include "daemon/config/notify_config.h"
#include "daemon/unattended/session_news.h"

namespace cellcal::daemon {

struct Message {
  std::string subject;  ///< one line
  std::string body;     ///< lines
  std::string json;     ///< with subject and body
};

/// `host`: name of this computer.
Message compose(const Notice& notice, Language language, const std::string& host);

}  // namespace cellcal::daemon
