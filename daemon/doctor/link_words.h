#pragma once
// Text of the link quality published by the daemon.

#include <nlohmann/json_fwd.hpp>
#include <string>

namespace cellcal::daemon {

/// From "links" of the status; "" for null. One line per link, each terminated. Keys missing in another
/// version are omitted.
std::string link_words(const nlohmann::json& links);

/// From "arm" of the status, one line: motion and packet age. "" where the daemon sends none.
std::string arm_words(const nlohmann::json& arm);

}  // namespace cellcal::daemon
