#pragma once
// Bytes as text (RFC 4648, section 4), by OpenSSL.

#include <optional>
#include <string>
#include <string_view>

namespace cellcal::daemon::plant {

std::string to_base64(std::string_view bytes);
/// None: it is no base64 in one line with its padding.
std::optional<std::string> from_base64(std::string_view text);

}  // namespace cellcal::daemon::plant
