-- Tables and views of the schema fleet. cellcal-fleet executes the file in an empty database, in one transaction;
-- a change of it is another kVersion (schema.cc).
CREATE TYPE refusal AS ENUM ('topic', 'size', 'rate', 'message', 'bound', 'database');
CREATE TYPE need AS ENUM
  ('interrupted', 'failed', 'drifted', 'check-not-held', 'offline', 'gap', 'withheld', 'overdue');

CREATE TABLE cells (
  id bigint GENERATED ALWAYS AS IDENTITY PRIMARY KEY,
  plant text NOT NULL, cell text NOT NULL,
  since timestamptz NOT NULL DEFAULT now(),
  UNIQUE (plant, cell));

CREATE TABLE presence (
  cell_id bigint PRIMARY KEY REFERENCES cells,
  online boolean NOT NULL, farewell boolean NOT NULL,
  journal text NOT NULL, number bigint NOT NULL,
  software text NOT NULL, mock boolean NOT NULL,
  at timestamptz NOT NULL, received timestamptz NOT NULL);

-- Which numbers of a journal have come, which were dropped by the cell for want of room, and up to which
-- number gaps are no mere disorder.
CREATE TABLE journals (
  id bigint GENERATED ALWAYS AS IDENTITY PRIMARY KEY,
  cell_id bigint NOT NULL REFERENCES cells,
  name text NOT NULL,
  since timestamptz NOT NULL DEFAULT now(),
  newest timestamptz NOT NULL DEFAULT now(),
  numbers int8multirange NOT NULL DEFAULT '{}',
  dropped int8multirange NOT NULL DEFAULT '{}',
  settled bigint NOT NULL DEFAULT 0,
  mark bigint NOT NULL DEFAULT 0, marked timestamptz NOT NULL DEFAULT now(),
  UNIQUE (cell_id, name));
CREATE INDEX ON journals (cell_id, id);

CREATE TABLE session_facts (
  journal_id bigint NOT NULL REFERENCES journals, number bigint NOT NULL, session bigint NOT NULL,
  at timestamptz NOT NULL, received timestamptz NOT NULL DEFAULT now(),
  state text NOT NULL, purpose text NOT NULL, cell_file text NOT NULL, robot_file text NOT NULL,
  started text NOT NULL, touches bigint NOT NULL, planned bigint NOT NULL,
  failure_kind text NOT NULL, failure text NOT NULL, software text NOT NULL,
  PRIMARY KEY (journal_id, number));

CREATE TABLE calibrations (
  journal_id bigint NOT NULL REFERENCES journals, number bigint NOT NULL, session bigint NOT NULL,
  at timestamptz NOT NULL, received timestamptz NOT NULL DEFAULT now(),
  robot text NOT NULL, robot_serial text NOT NULL,
  published boolean NOT NULL, is_update boolean NOT NULL, findings text[] NOT NULL,
  near_mm float8, over_mm float8, u95_near_mm float8, u95_over_mm float8,
  document bytea NOT NULL, sha256 text NOT NULL,
  PRIMARY KEY (journal_id, number));
CREATE INDEX ON calibrations (journal_id, session);
CREATE INDEX ON calibrations (robot);
CREATE INDEX ON calibrations (journal_id, number) WHERE published;

-- Of the arm, out of the document: correction of the nominal value and its 1 sigma.
CREATE TABLE corrections (
  journal_id bigint NOT NULL, number bigint NOT NULL,
  joint text NOT NULL, parameter text NOT NULL, unit text NOT NULL,
  correction float8 NOT NULL, sigma float8 NOT NULL, decided_by text NOT NULL,
  PRIMARY KEY (journal_id, number, joint, parameter),
  FOREIGN KEY (journal_id, number) REFERENCES calibrations);

CREATE TABLE checks (
  journal_id bigint NOT NULL REFERENCES journals, number bigint NOT NULL, session bigint NOT NULL,
  at timestamptz NOT NULL, received timestamptz NOT NULL DEFAULT now(),
  against bigint NOT NULL, held text NOT NULL, shift_mm float8, u_mm float8, cause text NOT NULL,
  temperature_c float8, document bytea NOT NULL, sha256 text NOT NULL,
  PRIMARY KEY (journal_id, number));

CREATE TABLE activations (
  journal_id bigint NOT NULL REFERENCES journals, number bigint NOT NULL, session bigint NOT NULL,
  at timestamptz NOT NULL, received timestamptz NOT NULL DEFAULT now(),
  by_whom text NOT NULL, reason text NOT NULL,
  PRIMARY KEY (journal_id, number));

CREATE TABLE certificates (
  journal_id bigint NOT NULL REFERENCES journals, number bigint NOT NULL, session bigint NOT NULL,
  at timestamptz NOT NULL, received timestamptz NOT NULL DEFAULT now(),
  certificate text NOT NULL,
  PRIMARY KEY (journal_id, number));
CREATE TABLE certificate_files (
  journal_id bigint NOT NULL, number bigint NOT NULL, position int NOT NULL, name text NOT NULL,
  bytes bytea NOT NULL, sha256 text NOT NULL,
  PRIMARY KEY (journal_id, number, position),
  FOREIGN KEY (journal_id, number) REFERENCES certificates);

CREATE TABLE alarms (
  journal_id bigint NOT NULL REFERENCES journals, number bigint NOT NULL, session bigint NOT NULL,
  at timestamptz NOT NULL, received timestamptz NOT NULL DEFAULT now(),
  news text NOT NULL, subject text NOT NULL, text text NOT NULL,
  PRIMARY KEY (journal_id, number));
CREATE INDEX ON alarms (journal_id, number) WHERE news IN ('drifted', 'recovered');

CREATE TABLE answers (
  journal_id bigint NOT NULL REFERENCES journals, number bigint NOT NULL, session bigint NOT NULL,
  at timestamptz NOT NULL, received timestamptz NOT NULL DEFAULT now(),
  proposal text NOT NULL, accepted boolean NOT NULL, by_whom text NOT NULL, reason text NOT NULL,
  PRIMARY KEY (journal_id, number));

CREATE TABLE drops (
  journal_id bigint NOT NULL REFERENCES journals, number bigint NOT NULL, session bigint NOT NULL,
  at timestamptz NOT NULL, received timestamptz NOT NULL DEFAULT now(),
  first bigint NOT NULL, last bigint NOT NULL, count bigint NOT NULL,
  PRIMARY KEY (journal_id, number));

CREATE TABLE phases (
  journal_id bigint NOT NULL, number bigint NOT NULL, session bigint NOT NULL,
  at timestamptz NOT NULL, received timestamptz NOT NULL DEFAULT now(),
  from_phase text NOT NULL, to_phase text NOT NULL, on_event text NOT NULL, clock_s float8 NOT NULL
) PARTITION BY RANGE (received);
CREATE INDEX ON phases (journal_id, number);

CREATE TABLE touches (
  journal_id bigint NOT NULL, number bigint NOT NULL, session bigint NOT NULL,
  at timestamptz NOT NULL, received timestamptz NOT NULL DEFAULT now(),
  index bigint NOT NULL, target text NOT NULL, held_out boolean NOT NULL,
  joints_deg float8[] NOT NULL, tip_mm float8[], residual_mm float8
) PARTITION BY RANGE (received);
CREATE INDEX ON touches (journal_id, number);

CREATE TABLE health (
  journal_id bigint NOT NULL, number bigint NOT NULL, session bigint NOT NULL,
  at timestamptz NOT NULL, received timestamptz NOT NULL DEFAULT now(),
  packets bigint NOT NULL, gaps bigint NOT NULL, late bigint NOT NULL, replies bigint NOT NULL,
  reply_p99_ms float8 NOT NULL, reply_max_ms float8 NOT NULL, frames bigint NOT NULL, crc_errors bigint NOT NULL,
  sensor_late_ms float8 NOT NULL, waiting bigint NOT NULL, journal_bytes bigint NOT NULL
) PARTITION BY RANGE (received);
CREATE INDEX ON health (journal_id, number);

CREATE TABLE quarantine (
  id bigint GENERATED ALWAYS AS IDENTITY PRIMARY KEY,
  received timestamptz NOT NULL DEFAULT now(),
  plant text NOT NULL, cell text NOT NULL,
  topic text NOT NULL, why refusal NOT NULL, words text NOT NULL,
  payload bytea NOT NULL, bytes bigint NOT NULL,
  sum text, times bigint NOT NULL DEFAULT 1);
CREATE INDEX ON quarantine (plant, cell, id);
CREATE UNIQUE INDEX ON quarantine (plant, cell, sum);
CREATE TABLE quarantine_counts (
  plant text NOT NULL, cell text NOT NULL, why refusal NOT NULL,
  count bigint NOT NULL, newest timestamptz NOT NULL,
  PRIMARY KEY (plant, cell, why));

CREATE TABLE settings (
  one boolean PRIMARY KEY DEFAULT true CHECK (one),
  calibration_days int NOT NULL DEFAULT 365, check_days int NOT NULL DEFAULT 0);
INSERT INTO settings DEFAULT VALUES;

-- The newest row of each cell is found by its index: a thousand cells and a million facts take tens of milliseconds.
-- A calibration is in use from when it is published until another is, or is put into use. Newest is what has the
-- highest number in the newest journal; no clock is asked.
CREATE VIEW in_use AS
SELECT c.id AS cell_id, e.journal_id, e.session, e.number FROM cells c CROSS JOIN LATERAL (
  SELECT n.* FROM journals j CROSS JOIN LATERAL (
    (SELECT k.journal_id, k.session, k.number FROM calibrations k
     WHERE k.journal_id = j.id AND k.published ORDER BY k.number DESC LIMIT 1)
    UNION ALL
    (SELECT a.journal_id, a.session, a.number FROM activations a WHERE a.journal_id = j.id ORDER BY a.number DESC LIMIT 1)
    ORDER BY number DESC LIMIT 1) n
  WHERE j.cell_id = c.id ORDER BY j.id DESC LIMIT 1) e;

CREATE VIEW calibrations_in_use AS
SELECT u.cell_id, u.number AS since_number, k.*, least(k.at, k.received) AS dated
FROM in_use u CROSS JOIN LATERAL (
  SELECT * FROM calibrations k WHERE k.journal_id = u.journal_id AND k.session = u.session AND k.published
  ORDER BY k.number DESC LIMIT 1) k;

CREATE VIEW newest_sessions AS
SELECT c.id AS cell_id, s.* FROM cells c CROSS JOIN LATERAL (
  SELECT n.* FROM journals j CROSS JOIN LATERAL (
    SELECT * FROM session_facts s WHERE s.journal_id = j.id ORDER BY s.number DESC LIMIT 1) n
  WHERE j.cell_id = c.id ORDER BY j.id DESC LIMIT 1) s;

-- Of the calibration in use, where the journal has one: a check of another one says nothing of it.
CREATE VIEW newest_checks AS
SELECT c.id AS cell_id, s.* FROM cells c LEFT JOIN in_use u ON u.cell_id = c.id CROSS JOIN LATERAL (
  SELECT n.* FROM journals j CROSS JOIN LATERAL (
    SELECT * FROM checks s
    WHERE s.journal_id = j.id AND (u.journal_id IS DISTINCT FROM j.id OR s.against = u.session)
    ORDER BY s.number DESC LIMIT 1) n
  WHERE j.cell_id = c.id ORDER BY j.id DESC LIMIT 1) s;

CREATE VIEW newest_calibrations AS
SELECT c.id AS cell_id, s.* FROM cells c CROSS JOIN LATERAL (
  SELECT n.* FROM journals j CROSS JOIN LATERAL (
    SELECT * FROM calibrations s WHERE s.journal_id = j.id AND NOT 'update_not_needed' = ANY (s.findings)
    ORDER BY s.number DESC LIMIT 1) n
  WHERE j.cell_id = c.id ORDER BY j.id DESC LIMIT 1) s;

CREATE VIEW newest_drift_alarms AS
SELECT c.id AS cell_id, s.* FROM cells c CROSS JOIN LATERAL (
  SELECT n.* FROM journals j CROSS JOIN LATERAL (
    SELECT * FROM alarms s WHERE s.journal_id = j.id AND s.news IN ('drifted', 'recovered')
    ORDER BY s.number DESC LIMIT 1) n
  WHERE j.cell_id = c.id ORDER BY j.id DESC LIMIT 1) s
WHERE s.news = 'drifted';

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
