#pragma once
// Files of the web page, embedded in the program.

#include <span>
#include <string_view>

namespace cellcal::daemon {

struct Asset {
  std::string_view path;  ///< "/page/app-2F4A.js"; "/" for the page itself
  std::string_view type;
  std::string_view etag;  ///< including its quotes
  std::string_view body;
  bool gzipped = true;
};

/// In a program built without the page: a single asset that explains so.
std::span<const Asset> assets();

}  // namespace cellcal::daemon
