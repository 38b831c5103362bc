#pragma once
// compared.json of an export.

#include <string>

#include "daemon/journal/journal.h"

namespace cellcal::daemon {

std::string compared_to_json(const Compared& compared);
/// Throws std::runtime_error.
Compared compared_from_json(const std::string& text);

}  // namespace cellcal::daemon
