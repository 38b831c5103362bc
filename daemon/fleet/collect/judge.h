#pragma once
// What a message is.

#include <string>

#include "daemon/fleet/collect/collector.h"
#include "daemon/fleet/store/batch.h"

namespace cellcal::daemon::fleet {

struct Message {
  std::string topic, payload;
};

/// Puts it into the batch as what it is. Throws nothing but std::bad_alloc.
void judge(Message message, Meters& meters, Meters::Time now, Batch& batch);

/// "2026-11-22T20:51:17.123Z", a day that there is, in the years 1970 to 9999.
bool is_time(std::string_view text);

}  // namespace cellcal::daemon::fleet
