#pragma once
// Selection of the handler of a request.

#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string_view>

#include "daemon/api/handlers.h"

namespace cellcal::daemon {

/// The resource does not exist.
struct NotFound : std::runtime_error {
  using std::runtime_error::runtime_error;
};

struct Match {
  const Api::Route* route = nullptr;  ///< null: no route for this method
  std::string_view variable{};        ///< value of the segment in braces
  bool path_known = false;            ///< the path exists with this or another method
};
Match match(const Request& request);

/// Integer parameter of the query; throws BadRequest where it is not an integer.
std::optional<std::int64_t> whole_number_in(const Request& request, const char* key);
/// Non-negative, digits only.
std::optional<std::int64_t> whole_number(std::string_view text);

}  // namespace cellcal::daemon
