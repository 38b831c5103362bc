#pragma once

#include <string>

#include "daemon/service/status.h"

namespace cellcal::daemon {

/// What systemd shows of a session: one assignment on one line, whatever a device's words hold.
std::string notification_of(const Status& status);

}  // namespace cellcal::daemon
