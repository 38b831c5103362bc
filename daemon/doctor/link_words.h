#pragma once
// Link quality as the daemon publishes it, in words.

#include <nlohmann/json_fwd.hpp>
#include <string>

namespace cellcal::daemon {

/// Of the status' "links"; "" where it is null. One line per link, each with its line end. What a
/// daemon of another version does not send is left out.
std::string link_words(const nlohmann::json& links);

/// Of the status' "arm", a line: what the newest packet shows of the arm, with its age. "" where the daemon sends none.
std::string arm_words(const nlohmann::json& arm);

}  // namespace cellcal::daemon
