#pragma once
// Opening a database file as a journal: created, accepted or refused.

#include <string>
#include <vector>

#include "daemon/journal/chain.h"

namespace cellcal::daemon {

/// Throws JournalError for a file of another program or schema version, or a damaged one, without
/// writing to it. Returns warnings.
std::vector<std::string> prepare(Database& database, HeadFile& head, Chain& chain);

// The journal's tables.
//
// A later version appends columns that are NULL in earlier rows, or adds tables: the checksums of earlier rows stay valid.

/// PRAGMA user_version. Versions 11 and 12 lack the last two, or the last, of touch's columns and are
/// converted; no other version is opened, and those up to 10 were never released.
inline constexpr int kSchemaVersion = 13;
/// PRAGMA application_id, "ccal": distinguishes a journal from other SQLite files.
inline constexpr int kApplicationId = 0x6363616c;

/// Precedes the sum of the schedule's state where a later one may exist.
inline constexpr const char* kOlderSchedule = "older ";

inline constexpr const char* kSchema = R"sql(
CREATE TABLE session (
  id          INTEGER PRIMARY KEY AUTOINCREMENT,
  started     TEXT NOT NULL,
  ended       TEXT NOT NULL DEFAULT '',
  state       TEXT NOT NULL,
  cell_name   TEXT NOT NULL,
  cell_text   TEXT NOT NULL,
  robot_name  TEXT NOT NULL,
  robot_text  TEXT NOT NULL,
  options     TEXT NOT NULL,
  plan_hash   TEXT NOT NULL DEFAULT '',
  planned     INTEGER NOT NULL DEFAULT 0,
  failure     TEXT NOT NULL DEFAULT '',
  calibration TEXT NOT NULL DEFAULT '',
  software    TEXT NOT NULL,       -- that began it
  origin      TEXT,                -- JSON, of an imported one
  outcome     TEXT,                -- JSON, cellcal.outcome/1; both written with the end
  document    TEXT                 -- JSON of a check, a qualification, found spheres or a failure
) STRICT;
CREATE TABLE touch (
  session       INTEGER NOT NULL REFERENCES session(id),
  number        INTEGER NOT NULL,
  joint_rad     BLOB NOT NULL,     -- doubles, little endian
  target        TEXT NOT NULL,
  held_out      INTEGER NOT NULL,
  sigma_m       REAL NOT NULL,
  radius_m      REAL NOT NULL,
  tracker_m     BLOB NOT NULL,
  time          TEXT NOT NULL,
  settled_rad   BLOB NOT NULL,
  readings      INTEGER NOT NULL,
  spread_m      REAL NOT NULL,
  speed_m_s     REAL NOT NULL,
  tool          TEXT NOT NULL,
  turn_sigma_rad  REAL NOT NULL,
  tracker_abc_rad BLOB,
  approach        BLOB,
  temperature_c   REAL,
  load            TEXT,            -- held; NULL: none
  positioner_rad  BLOB,            -- of a positioner's axes; NULL: none
  UNIQUE (session, number)
) STRICT;
CREATE TABLE reading (
  session      INTEGER NOT NULL REFERENCES session(id),
  touch        INTEGER NOT NULL,
  number       INTEGER NOT NULL,   -- 0: the fast search
  slow         INTEGER NOT NULL,
  contact_rad  BLOB NOT NULL,
  settled_rad  BLOB NOT NULL,
  along_m      REAL NOT NULL,
  time_sigma_s REAL NOT NULL,
  reaction_s   REAL NOT NULL,
  bounces      INTEGER NOT NULL,
  time         TEXT NOT NULL
) STRICT;
CREATE TABLE event (
  session INTEGER NOT NULL REFERENCES session(id),
  time    TEXT NOT NULL,
  words   TEXT NOT NULL
) STRICT;
CREATE INDEX event_of_session ON event (session);
CREATE INDEX reading_of_session ON reading (session);
-- Checksums of all rows.
CREATE TABLE chain (
  number  INTEGER PRIMARY KEY,   -- 1, 2, 3, without a gap
  session INTEGER NOT NULL,
  kind    TEXT NOT NULL,         -- the row's table; "journal": the first entry
  row     INTEGER NOT NULL,      -- its rowid
  digest  TEXT NOT NULL,         -- SHA-256 of the row
  sum     TEXT NOT NULL          -- SHA-256 of the entry before and of this one
) STRICT;
CREATE INDEX chain_of_session ON chain (session, kind);
CREATE TABLE change (
  session       INTEGER NOT NULL REFERENCES session(id),
  time          TEXT NOT NULL,
  clock_s       REAL NOT NULL,     -- session's clock
  from_phase    TEXT NOT NULL,
  to_phase      TEXT NOT NULL,
  event         TEXT NOT NULL,
  late_replies  INTEGER NOT NULL,  -- as the controller had counted them
  sensor_late_s REAL NOT NULL      -- worst delivery of the sensor's bytes
) STRICT;
CREATE TABLE contact (
  session            INTEGER NOT NULL REFERENCES session(id),
  touch              INTEGER NOT NULL,  -- in hand
  time               TEXT NOT NULL,
  kind               TEXT NOT NULL,     -- trip, contact, revoked, release
  arm_id             INTEGER NOT NULL,
  sequence           INTEGER NOT NULL,  -- of the frame, modulo 256
  number             INTEGER NOT NULL,  -- the sensor's; 0: a trip
  ticks              INTEGER NOT NULL,  -- first edge, sensor's clock, 0.5 us, modulo 2^32
  confirmed_after_us INTEGER NOT NULL,
  bounces            INTEGER NOT NULL,
  sense_v            REAL NOT NULL,
  heard_s            REAL NOT NULL,     -- session's clock
  first_edge_s       REAL NOT NULL,     -- session's clock, by the clock map
  time_sigma_s       REAL NOT NULL,
  lost               INTEGER NOT NULL   -- events before this one that are not here
) STRICT;
CREATE TABLE compared (
  session     INTEGER NOT NULL REFERENCES session(id),
  words       TEXT NOT NULL,            -- which calibration; the newest row counts
  accepted    INTEGER NOT NULL,         -- a changed arm was to be accepted
  calibration TEXT NOT NULL             -- JSON
) STRICT;
CREATE INDEX change_of_session ON change (session);
CREATE INDEX contact_of_session ON contact (session);
CREATE INDEX compared_of_session ON compared (session);
-- Sessions whose raw rows were dropped.
CREATE TABLE dropped (
  session INTEGER NOT NULL REFERENCES session(id),
  time    TEXT NOT NULL,
  rows    INTEGER NOT NULL   -- of event, change, contact and reading
) STRICT;
CREATE INDEX dropped_of_session ON dropped (session);
-- Calibrations that were put into use although a newer one was published.
CREATE TABLE activation (
  session INTEGER NOT NULL REFERENCES session(id),  -- whose calibration
  time    TEXT NOT NULL,
  who     TEXT NOT NULL,
  reason  TEXT NOT NULL
) STRICT;
CREATE INDEX activation_of_session ON activation (session);
-- Reports that are not acknowledged yet. Not part of the chain: the rows that they report are.
CREATE TABLE outbox (
  number  INTEGER PRIMARY KEY AUTOINCREMENT,  -- never used twice
  session INTEGER NOT NULL,                   -- 0: of none
  time    TEXT NOT NULL,
  kind    TEXT NOT NULL,
  worth   TEXT NOT NULL,                      -- result, telemetry
  body    TEXT NOT NULL                       -- JSON; '': composed of the session's calibration
) STRICT;
CREATE INDEX outbox_telemetry ON outbox (number) WHERE worth='telemetry';
CREATE TABLE outbox_source (
  first       INTEGER PRIMARY KEY,            -- number in outbox that is the first under this name
  name        TEXT NOT NULL,
  interrupted INTEGER NOT NULL DEFAULT 0,     -- entry of the chain whose interruption was reported
  address     TEXT NOT NULL DEFAULT ''        -- under which its numbers are reported; '': not known
) STRICT;
-- State of the schedule; one row, which is replaced. Belongs to no session, hence its own sum.
CREATE TABLE schedule (
  id    INTEGER PRIMARY KEY CHECK (id = 1),
  state TEXT NOT NULL,                        -- JSON, cellcal.schedule/1
  sum   TEXT NOT NULL                         -- SHA-256 of state
) STRICT;
-- Searches for spheres, written before the motion; harmless interruptions.
CREATE TABLE search (
  session INTEGER NOT NULL REFERENCES session(id),
  time    TEXT NOT NULL,
  target  TEXT NOT NULL,     -- '': nothing is searched, the arm goes home
  axes    INTEGER NOT NULL,
  way_rad BLOB NOT NULL,     -- postures from where the arm stood to the stand-off; doubles, little endian
  end_rad BLOB NOT NULL,     -- of the search; empty: none
  out_rad BLOB NOT NULL      -- postures from the clear point out; empty: no way is known
) STRICT;
CREATE TABLE interruption (
  session INTEGER NOT NULL REFERENCES session(id),
  time    TEXT NOT NULL,
  cause   TEXT NOT NULL      -- sensor-data-late, robot-replies-late, packets-stopped
) STRICT;
CREATE INDEX search_of_session ON search (session);
CREATE INDEX interruption_of_session ON interruption (session);
)sql";

}  // namespace cellcal::daemon
