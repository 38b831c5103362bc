#include "daemon/fleet/store/schema.h"

namespace cellcal::daemon::fleet {

// A plant alarms as long as the cell's own control chart does; an update that found nothing changed withholds no calibration.
const char* const kOutcomes = R"sql(
CREATE INDEX ON alarms (journal_id, number) WHERE news IN ('drifted', 'recovered');

CREATE OR REPLACE VIEW newest_drift_alarms AS
SELECT c.id AS cell_id, s.* FROM cells c CROSS JOIN LATERAL (
  SELECT n.* FROM journals j CROSS JOIN LATERAL (
    SELECT * FROM alarms s WHERE s.journal_id = j.id AND s.news IN ('drifted', 'recovered')
    ORDER BY s.number DESC LIMIT 1) n
  WHERE j.cell_id = c.id ORDER BY j.id DESC LIMIT 1) s
WHERE s.news = 'drifted';

CREATE OR REPLACE VIEW newest_calibrations AS
SELECT c.id AS cell_id, s.* FROM cells c CROSS JOIN LATERAL (
  SELECT n.* FROM journals j CROSS JOIN LATERAL (
    SELECT * FROM calibrations s WHERE s.journal_id = j.id AND NOT 'update_not_needed' = ANY (s.findings)
    ORDER BY s.number DESC LIMIT 1) n
  WHERE j.cell_id = c.id ORDER BY j.id DESC LIMIT 1) s;
)sql";

}  // namespace cellcal::daemon::fleet
