#pragma once
// One POST of JSON over HTTP or TLS. The certificate is verified against the host's name; redirects are not followed.
//
// Waits on the thread that calls, for its time-out at the longest, and for the system's resolver, which has its own.

#include <string>

#include "daemon/config/notify_config.h"

namespace cellcal::daemon {

struct Delivery {
  bool delivered = false;
  bool again = false;  ///< it may succeed later
  std::string why;     ///< empty: delivered
};

/// `secret` is sent as X-Cellcal-Secret unless it is empty.
Delivery post(const WebhookConfig& config, const std::string& secret, const std::string& json);

/// The file's first line; empty where none is configured. Throws std::runtime_error: missing, empty, readable by
/// everybody, or no line that a header can hold.
std::string read_secret(const std::filesystem::path& file);

}  // namespace cellcal::daemon
