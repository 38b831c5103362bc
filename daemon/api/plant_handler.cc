// How the line to the plant stands, and what waits for it.

#include <nlohmann/json.hpp>

#include "daemon/api/handlers.h"
#include "daemon/api/http/json_text.h"
#include "daemon/api/routes.h"
#include "daemon/plant/publisher/line_status.h"

namespace cellcal::daemon {

std::optional<Response> Api::show_plant(const Call&) {
  const auto line = plant_line_ ? plant_line_() : std::nullopt;
  if (!line) throw NotFound("no plant is named: [plant] in cellcald.toml");
  const OutboxCount count = journal_.outbox();
  return Response{.body = dump({{"connected", line->connected},
                                {"since", line->since},
                                {"problem", to_string(line->problem)},
                                {"words", line->words},
                                {"acknowledged", line->acknowledged},
                                {"source", count.source},
                                {"newest", count.newest},
                                {"waiting", count.rows},
                                {"waiting_bytes", count.bytes},
                                {"dropped", count.dropped},
                                {"not_begun", count.not_begun}})};
}

}  // namespace cellcal::daemon
