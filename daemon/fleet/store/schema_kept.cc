#include "daemon/fleet/store/schema.h"

namespace cellcal::daemon::fleet {

// A message that comes again and again is kept once. Those of before have no sum.
const char* const kKept = R"sql(
ALTER TABLE quarantine ADD COLUMN sum text, ADD COLUMN times bigint NOT NULL DEFAULT 1;
CREATE UNIQUE INDEX ON quarantine (plant, cell, sum);
)sql";

}  // namespace cellcal::daemon::fleet
