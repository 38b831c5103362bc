-- A journal as schema 1 wrote it: a session that is done, and one that was left running by a kill.
PRAGMA journal_mode = WAL;
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
PRAGMA application_id = 0x6363616c;
PRAGMA user_version = 1;
INSERT INTO session (started, ended, state, cell_name, cell_text, robot_name, robot_text, options, plan_hash, planned)
  VALUES ('2026-01-02T03:04:05.000Z', '2026-01-02T03:14:05.000Z', 'done', '/c', 'cell', '/r', 'robot', '{}', 'h', 2),
         ('2026-01-03T03:04:05.000Z', '', 'running', '/c', 'cell', '/r', 'robot', '{}', 'h', 9);
INSERT INTO touch VALUES
  (1, 0, x'9a9999999999b93f666666666666f6bfcdccccccccccf43f9a9999999999c93f9a9999999999f13f333333333333d33f', 'S1', 0, 0, 0, x'', 't', x'', 2, 0.0, 0.002),
  (1, 1, x'9a9999999999b93f666666666666f6bfcdccccccccccf43f9a9999999999c93f9a9999999999f13f333333333333d33f', 'S2', 1, 0, 0, x'', 't', x'', 2, 0.0, 0.002),
  (2, 0, x'9a9999999999b93f666666666666f6bfcdccccccccccf43f9a9999999999c93f9a9999999999f13f333333333333d33f', 'S1', 0, 0, 0, x'', 't', x'', 2, 0.0, 0.002);
INSERT INTO reading VALUES (2, 0, 0, 0, x'', x'', 0.0125, 0, 0, 0, 't'),
                           (2, 0, 1, 1, x'', x'', 0.0120, 0, 0, 0, 't');
INSERT INTO event VALUES (2, 't', 'transit -> arming fast');
