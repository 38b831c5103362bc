#pragma once
// Request body of POST /v1/run.

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "daemon/api/http/message.h"
#include "daemon/service/service.h"

namespace cellcal::daemon {

/// Throws BadRequest naming the key.
RunRequest run_request(const std::string& body);

// Author and reason in a request body.

inline constexpr std::size_t kLongestReason = 500;

/// One non-empty line. Throws BadRequest.
std::string line_in(const nlohmann::json& body, const char* key, std::size_t longest);
/// Author of a request: the name under "by", which is not verified, followed by the token's name. Throws
/// BadRequest.
std::string author_of(const Request& request, const nlohmann::json& body);

// Files of this computer that a network request may name.

/// Files of one kind, and the alternative for a file outside the folders.
struct NetworkFiles {
  const char* what;     ///< "a cell file"
  const char* instead;  ///< in the imperative
  std::vector<std::filesystem::path> folders;
};

/// Over the network a file has to lie directly in one of the folders, under its own name: neither it nor its
/// folder may be a link. Otherwise throws RequestError, with a text that does not reveal whether the file
/// exists. Over the Unix socket any file may be named.
void keep_within(const Request& request, const std::filesystem::path& file,
                 const NetworkFiles& allowed);

}  // namespace cellcal::daemon
