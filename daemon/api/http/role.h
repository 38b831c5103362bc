#pragma once
// Who asks, and what he may do.

#include <optional>
#include <string>
#include <string_view>

namespace cellcal::daemon {

/// Each may do what those before it may.
enum class Role { kNobody, kLook, kOperate, kAdminister };

const char* to_string(Role role);
/// "look", "operate", "administer"; nothing for any other word.
std::optional<Role> parse_role(std::string_view word);

/// Of who comes over the Unix socket.
inline constexpr const char* kLocalName = "local";

struct Caller {
  Role role = Role::kNobody;
  std::string name{};  ///< the token's; "local" over the Unix socket
};

}  // namespace cellcal::daemon
