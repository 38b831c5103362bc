#pragma once
// The USB adapter in front of the contact sensor, judged.

#include <optional>
#include <string>

#include "daemon/doctor/finding.h"
#include "drivers/contact/port/adapter.h"

namespace cellcal::daemon {

void judge_adapter(const std::string& device, const std::optional<drivers::Adapter>& adapter,
                   int baud, Findings& findings);

}  // namespace cellcal::daemon
