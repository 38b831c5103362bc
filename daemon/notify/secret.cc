#include "daemon/notify/secret.h"

#include <sys/stat.h>

#include <algorithm>
#include <fstream>
#include <stdexcept>

namespace cellcal::daemon {

std::string read_secret(const std::filesystem::path& file) {
  if (file.empty()) return "";
  struct ::stat status {};
  if (::stat(file.c_str(), &status) != 0)
    throw std::runtime_error(file.string() + ": there is no such file, or it cannot be read");
  if ((status.st_mode & S_IROTH) != 0)
    throw std::runtime_error(file.string() + ": everybody may read it. chmod o-r " + file.string());
  std::ifstream in(file);
  std::string line;
  std::getline(in, line);
  const bool sound =
      !line.empty() && line.size() <= 1000 &&
      std::all_of(line.begin(), line.end(), [](char c) { return '!' <= c && c <= '~'; });
  if (!sound)
    throw std::runtime_error(file.string() +
                             ": its first line must be 1 to 1000 visible ASCII characters");
  return line;
}

}  // namespace cellcal::daemon
