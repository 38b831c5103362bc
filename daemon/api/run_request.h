#pragma once
// What POST /v1/run asks for.

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "daemon/api/http/message.h"
#include "daemon/service/service.h"

namespace cellcal::daemon {

/// Throws BadRequest naming the key.
RunRequest run_request(const std::string& body);

// Who says so, and why, as a request's body has it.

inline constexpr std::size_t kLongestReason = 500;

/// One line that says something. Throws BadRequest.
std::string line_in(const nlohmann::json& body, const char* key, std::size_t longest);
/// The token's name, and in front of it what stands under "by": who says to be somebody is so by the word of this token
/// alone, which stays beside it. Throws BadRequest.
std::string who_asks(const Request& request, const nlohmann::json& body);

// Which files of this computer a request over the network may name.

/// Files of one kind, and what else there is for a file that lies elsewhere.
struct NetworkFiles {
  const char* what;     ///< "a cell file"
  const char* instead;  ///< an imperative
  std::vector<std::filesystem::path> folders;
};

/// Over the network a file lies directly in one of the folders, under its own name: neither it nor its folder is a link. Throws
/// RequestError otherwise, in words that do not depend on whether there is such a file. Over the Unix socket any file may be named.
void keep_within(const Request& request, const std::filesystem::path& file,
                 const NetworkFiles& allowed);

}  // namespace cellcal::daemon
