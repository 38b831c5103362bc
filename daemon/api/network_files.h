#pragma once
// Which files of this computer a request over the network may name.

#include <filesystem>
#include <string>
#include <vector>

#include "daemon/api/http/message.h"

namespace cellcal::daemon {

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
