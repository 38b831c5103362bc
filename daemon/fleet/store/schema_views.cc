#include "daemon/fleet/store/schema.h"

namespace cellcal::daemon::fleet {

const char* const kViews = R"sql(
CREATE TYPE need AS ENUM
  ('interrupted', 'failed', 'drifted', 'check-not-held', 'offline', 'gap', 'withheld', 'overdue');

CREATE TABLE settings (
  one boolean PRIMARY KEY DEFAULT true CHECK (one),
  calibration_days int NOT NULL DEFAULT 365, check_days int NOT NULL DEFAULT 0);
INSERT INTO settings DEFAULT VALUES;

-- A calibration is in use from when it is published until another is, or is put into use. Newest is what has the
-- highest number in the newest journal; no clock is asked.
CREATE VIEW in_use AS
SELECT DISTINCT ON (j.cell_id) j.cell_id, e.journal_id, e.session, e.number
FROM (SELECT journal_id, session, number FROM calibrations WHERE published
      UNION ALL SELECT journal_id, session, number FROM activations) e
JOIN journals j ON j.id = e.journal_id
ORDER BY j.cell_id, e.journal_id DESC, e.number DESC;

CREATE VIEW calibrations_in_use AS
SELECT DISTINCT ON (u.cell_id) u.cell_id, u.number AS since_number, c.*, least(c.at, c.received) AS dated
FROM in_use u JOIN calibrations c ON c.journal_id = u.journal_id AND c.session = u.session AND c.published
ORDER BY u.cell_id, c.number DESC;

CREATE VIEW newest_sessions AS
SELECT DISTINCT ON (j.cell_id) j.cell_id, s.* FROM session_facts s JOIN journals j ON j.id = s.journal_id
ORDER BY j.cell_id, s.journal_id DESC, s.number DESC;

CREATE VIEW newest_checks AS
SELECT DISTINCT ON (j.cell_id) j.cell_id, k.* FROM checks k JOIN journals j ON j.id = k.journal_id
ORDER BY j.cell_id, k.journal_id DESC, k.number DESC;

CREATE VIEW newest_calibrations AS
SELECT DISTINCT ON (j.cell_id) j.cell_id, c.* FROM calibrations c JOIN journals j ON j.id = c.journal_id
ORDER BY j.cell_id, c.journal_id DESC, c.number DESC;

CREATE VIEW newest_drift_alarms AS
SELECT DISTINCT ON (j.cell_id) j.cell_id, a.* FROM alarms a JOIN journals j ON j.id = a.journal_id
WHERE a.news = 'drifted' ORDER BY j.cell_id, a.journal_id DESC, a.number DESC;

CREATE VIEW gaps AS
SELECT c.id AS cell_id, c.plant, c.cell, j.name AS journal, lower(g) AS first, upper(g) - 1 AS last,
       upper(g) - 1 <= j.settled AS settled, j.newest
FROM journals j JOIN cells c ON c.id = j.cell_id,
LATERAL unnest(int8multirange(int8range(1, upper(j.numbers))) - j.numbers - j.dropped) g
WHERE j.numbers <> '{}';

CREATE VIEW overdue AS
SELECT c.id AS cell_id, c.plant, c.cell, 'calibration' AS of, u.dated AS last,
       coalesce(u.dated + make_interval(days => s.calibration_days), c.since) AS due
FROM settings s, cells c LEFT JOIN calibrations_in_use u ON u.cell_id = c.id
WHERE u.dated IS NULL OR u.dated + make_interval(days => s.calibration_days) < now()
UNION ALL
SELECT c.id, c.plant, c.cell, 'check', k.last, k.last + make_interval(days => s.check_days)
FROM settings s, cells c JOIN calibrations_in_use u ON u.cell_id = c.id
LEFT JOIN newest_checks n ON n.cell_id = c.id,
LATERAL (SELECT greatest(u.dated, least(n.at, n.received)) AS last) k
WHERE s.check_days > 0 AND k.last + make_interval(days => s.check_days) < now();

CREATE VIEW attention AS
SELECT c.plant, c.cell, n.what, n.since, n.detail FROM cells c JOIN (
  SELECT cell_id, (CASE state WHEN 'failed' THEN 'failed' ELSE 'interrupted' END)::need AS what,
         least(at, received) AS since, coalesce(nullif(failure, ''), purpose) AS detail
  FROM newest_sessions WHERE state IN ('failed', 'interrupted')
  UNION ALL
  SELECT a.cell_id, 'drifted', least(a.at, a.received), a.subject
  FROM newest_drift_alarms a LEFT JOIN calibrations_in_use u ON u.cell_id = a.cell_id
  WHERE u.cell_id IS NULL OR (a.journal_id, a.number) > (u.journal_id, u.since_number)
  UNION ALL
  SELECT k.cell_id, 'check-not-held', least(k.at, k.received), k.cause
  FROM newest_checks k LEFT JOIN calibrations_in_use u ON u.cell_id = k.cell_id
  WHERE k.held = 'no' AND (u.cell_id IS NULL OR (k.journal_id, k.number) > (u.journal_id, u.since_number))
  UNION ALL
  SELECT cell_id, 'offline', received, CASE WHEN farewell THEN 'farewell' ELSE 'lost' END
  FROM presence WHERE NOT online
  UNION ALL
  SELECT cell_id, 'gap', min(newest), sum(last - first + 1)::text FROM gaps WHERE settled GROUP BY cell_id
  UNION ALL
  SELECT cell_id, 'withheld', least(at, received), array_to_string(findings, ', ')
  FROM newest_calibrations WHERE NOT published
  UNION ALL
  SELECT cell_id, 'overdue', due, of FROM overdue
) n ON n.cell_id = c.id;

CREATE VIEW joint_drift AS
SELECT c.plant, c.cell, k.robot, k.robot_serial, least(k.at, k.received) AS at, k.session,
       r.joint, r.parameter, r.unit, r.correction, r.sigma, r.decided_by
FROM corrections r JOIN calibrations k USING (journal_id, number)
JOIN journals j ON j.id = k.journal_id JOIN cells c ON c.id = j.cell_id WHERE k.published;

CREATE VIEW joint_corrections AS
SELECT c.plant, c.cell, u.robot, u.robot_serial, u.dated AS at, u.session,
       r.joint, r.parameter, r.unit, r.correction, r.sigma, r.decided_by
FROM calibrations_in_use u JOIN corrections r USING (journal_id, number) JOIN cells c ON c.id = u.cell_id;

CREATE VIEW cell_states AS
SELECT c.plant, c.cell, c.since, p.online, p.farewell, p.received AS presence_at, p.software, p.mock,
       s.session, s.state, s.purpose, s.touches, s.planned, least(s.at, s.received) AS session_at,
       u.robot, u.robot_serial, j.name AS journal, u.session AS calibration, u.dated AS calibrated_at,
       u.near_mm, u.over_mm, u.u95_near_mm, u.u95_over_mm, k.held, k.shift_mm, least(k.at, k.received) AS checked_at
FROM cells c LEFT JOIN presence p ON p.cell_id = c.id LEFT JOIN newest_sessions s ON s.cell_id = c.id
LEFT JOIN calibrations_in_use u ON u.cell_id = c.id LEFT JOIN journals j ON j.id = u.journal_id
LEFT JOIN newest_checks k ON k.cell_id = c.id;

CREATE VIEW refusals AS SELECT plant, cell, why, count, newest FROM quarantine_counts;
)sql";

}  // namespace cellcal::daemon::fleet
