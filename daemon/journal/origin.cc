#include "daemon/journal/origin.h"

#include <nlohmann/json.hpp>

namespace cellcal::daemon {

using nlohmann::json;

std::string to_text(const Origin& origin) {
  return json{{"journal", origin.journal},
              {"session", origin.session},
              {"sum", origin.sum},
              {"entries", origin.entries},
              {"entries_sum", origin.entries_sum}}
      .dump();
}

Origin origin_of(const std::string& text) try {
  const json stored = json::parse(text);
  return {stored.value("journal", ""), stored.value("session", std::int64_t{0}),
          stored.value("sum", ""), stored.value("entries", std::size_t{0}),
          stored.value("entries_sum", "")};
} catch (const json::exception&) {  // said above
  return {};
}

}  // namespace cellcal::daemon
