#include "daemon/api/http/role.h"

namespace cellcal::daemon {

const char* to_string(Role role) {
  switch (role) {
    case Role::kLook:
      return "look";
    case Role::kOperate:
      return "operate";
    case Role::kAdminister:
      return "administer";
    case Role::kNobody:
      break;
  }
  return "nobody";
}

std::optional<Role> parse_role(std::string_view word) {
  for (const Role role : {Role::kLook, Role::kOperate, Role::kAdminister}) {
    if (word == to_string(role)) return role;
  }
  return std::nullopt;
}

}  // namespace cellcal::daemon
