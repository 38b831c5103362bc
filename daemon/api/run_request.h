#pragma once
// What POST /v1/run asks for.

#include <string>

#include "daemon/api/http/message.h"
#include "daemon/service/service.h"

namespace cellcal::daemon {

/// Throws BadRequest naming the key.
RunRequest run_request(const std::string& body);
/// Who asks from afar names cell files and nothing else of this computer's: throws RequestError, whether or not there is such
/// a file.
void refuse_other_files(const Request& request, const std::filesystem::path& cell);

}  // namespace cellcal::daemon
