#pragma once

#include <string>

namespace cellcal::daemon {

/// Who is logged in, also behind sudo; printable.
std::string user_name();

}  // namespace cellcal::daemon
