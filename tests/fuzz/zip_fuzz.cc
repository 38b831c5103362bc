// Any bytes as a ZIP archive: refused with FileError naming it, or files within the size allowed.

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string_view>

#include "calib/model/error.h"
#include "daemon/cli/backup.h"

namespace {

void require(bool condition, const char* what) {
  if (condition) return;
  std::fprintf(stderr, "broken promise: %s\n", what);
  std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  constexpr std::size_t kMost = 1u << 20;
  try {
    std::size_t bytes = 0;
    for (const auto& file : cellcal::daemon::unzip(
             {reinterpret_cast<const char*>(data), size}, "fuzz.zip",
             [](std::string_view) { return true; }, kMost))
      bytes += file.text.size();
    require(bytes <= kMost, "no more than allowed");
  } catch (const cellcal::calib::FileError& error) {
    require(error.file == "fuzz.zip", "an error without its file");
  }
  return 0;
}
