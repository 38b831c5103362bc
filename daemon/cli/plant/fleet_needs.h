#pragma once
// Why a cell needs attention, in words.

#include <nlohmann/json_fwd.hpp>
#include <string>

namespace cellcal::daemon {

/// Of one entry of `needs` (daemon/fleet/api): what it is, since when, what to do. One line.
std::string need_words(const nlohmann::json& need);

}  // namespace cellcal::daemon
