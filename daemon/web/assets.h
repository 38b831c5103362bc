#pragma once
// The files of the page, as they are in the program.

#include <span>
#include <string_view>

namespace cellcal::daemon {

struct Asset {
  std::string_view path;  ///< "/page/app-2F4A.js"; of the page itself "/"
  std::string_view type;
  std::string_view etag;  ///< with its quotes
  std::string_view body;
  bool gzipped = true;
};

/// Of a program that was built without the page one: what says so.
std::span<const Asset> assets();

}  // namespace cellcal::daemon
