#pragma once
// Text of the link quality published by the daemon.

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

#include "daemon/doctor/examiner.h"
#include "drivers/contact/port/adapter.h"

namespace cellcal::daemon {

/// From "links" of the status; "" for null. One line per link, each terminated. Keys missing in another
/// version are omitted.
std::string link_words(const nlohmann::json& links);

/// From "arm" of the status, one line: motion and packet age. "" where the daemon sends none.
std::string arm_words(const nlohmann::json& arm);

// Judges the path to the contact sensor: USB adapter or network interface.

void judge_adapter(const std::string& device, const std::optional<drivers::Adapter>& adapter,
                   int baud, Findings& findings);

/// For a board on Ethernet; reported under the same check.
void judge_interface(const std::optional<drivers::BoardInterface>& way, Findings& findings);

}  // namespace cellcal::daemon
