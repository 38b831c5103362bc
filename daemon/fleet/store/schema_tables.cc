#include "daemon/fleet/store/schema.h"

namespace cellcal::daemon::fleet {

const char* const kTables = R"sql(
CREATE TYPE refusal AS ENUM ('topic', 'size', 'rate', 'message', 'bound', 'database');

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
  payload bytea NOT NULL, bytes bigint NOT NULL);
CREATE INDEX ON quarantine (plant, cell, id);
CREATE TABLE quarantine_counts (
  plant text NOT NULL, cell text NOT NULL, why refusal NOT NULL,
  count bigint NOT NULL, newest timestamptz NOT NULL,
  PRIMARY KEY (plant, cell, why));
)sql";

}  // namespace cellcal::daemon::fleet
