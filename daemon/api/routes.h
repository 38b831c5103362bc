#pragma once
// Which of the handlers a request is for.

#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string_view>

#include "daemon/api/handlers.h"

namespace cellcal::daemon {

/// There is no such thing.
struct NotFound : std::runtime_error {
  using std::runtime_error::runtime_error;
};

struct Match {
  const Api::Route* route = nullptr;  ///< null: nothing is there for this method
  std::string_view variable{};        ///< of the path that was matched
  bool path_known = false;            ///< with this or another method
};
Match match(const Request& request);

/// A parameter of the query that is a whole number; throws BadRequest where it is not one.
std::optional<std::int64_t> whole_number_in(const Request& request, const char* key);
/// Not negative, digits only.
std::optional<std::int64_t> whole_number(std::string_view text);

}  // namespace cellcal::daemon
