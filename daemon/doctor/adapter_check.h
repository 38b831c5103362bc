#pragma once
// Judges the path to the contact sensor: USB adapter or network interface.

#include <optional>
#include <string>

#include "daemon/doctor/finding.h"
#include "drivers/contact/port/adapter.h"

namespace cellcal::daemon {

void judge_adapter(const std::string& device, const std::optional<drivers::Adapter>& adapter,
                   int baud, Findings& findings);

/// For a board on Ethernet; reported under the same check.
void judge_interface(const std::optional<drivers::BoardInterface>& way, Findings& findings);

}  // namespace cellcal::daemon
