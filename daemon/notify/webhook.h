#pragma once
// One POST of JSON over HTTP or TLS.

#include <string>

#include "daemon/config/notify_config.h"
#include "daemon/notify/transfer.h"

namespace cellcal::daemon {

/// `secret` is sent as X-Cellcal-Secret unless it is empty.
Delivery post(const WebhookConfig& config, const std::string& secret, const std::string& json);

}  // namespace cellcal::daemon
