#pragma once
// The journal's tables. A change of meaning needs a new version and its migration.

namespace cellcal::daemon {

/// PRAGMA user_version.
inline constexpr int kSchemaVersion = 2;
/// The only earlier one: the same tables without `chain`.
inline constexpr int kSchemaWithoutChain = 1;
/// PRAGMA application_id, "ccal": tells a journal from any other SQLite file.
inline constexpr int kApplicationId = 0x6363616c;

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
  calibration TEXT NOT NULL DEFAULT ''
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
)sql";

inline constexpr const char* kChainSchema = R"sql(
CREATE TABLE chain (
  number  INTEGER PRIMARY KEY,   -- 1, 2, 3, without a gap
  session INTEGER NOT NULL,
  kind    TEXT NOT NULL,         -- the row's table; "journal": the first entry
  row     INTEGER NOT NULL,      -- its rowid
  digest  TEXT NOT NULL,         -- SHA-256 of the row
  sum     TEXT NOT NULL          -- SHA-256 of the entry before and of this one
) STRICT;
CREATE INDEX chain_of_session ON chain (session, kind);
)sql";

}  // namespace cellcal::daemon
