#include "daemon/cli/user_name.h"

#include <pwd.h>
#include <unistd.h>

#include <cstdlib>

#include "daemon/files/printable.h"

namespace cellcal::daemon {

std::string user_name() {
  const char* before_sudo = std::getenv("SUDO_USER");
  if (before_sudo != nullptr && *before_sudo != '\0') return printable(before_sudo);
  const passwd* entry = ::getpwuid(::getuid());
  return entry != nullptr ? printable(entry->pw_name) : std::to_string(::getuid());
}

}  // namespace cellcal::daemon
