#pragma once
// A journal as schema 2 wrote it, in that version's own words: nothing of it is taken from schema.h.

#include <fmt/format.h>

#include <filesystem>
#include <string>

#include "calib/files/files.h"
#include "calib/files/input_file.h"
#include "daemon/journal/store/head_file.h"
#include "daemon/journal/store/sqlite.h"

namespace cellcal::daemon::testing {

inline constexpr const char* kVersion2 = R"sql(
CREATE TABLE session (id INTEGER PRIMARY KEY AUTOINCREMENT, started TEXT NOT NULL,
  ended TEXT NOT NULL DEFAULT '', state TEXT NOT NULL, cell_name TEXT NOT NULL,
  cell_text TEXT NOT NULL, robot_name TEXT NOT NULL, robot_text TEXT NOT NULL,
  options TEXT NOT NULL, plan_hash TEXT NOT NULL DEFAULT '', planned INTEGER NOT NULL DEFAULT 0,
  failure TEXT NOT NULL DEFAULT '', calibration TEXT NOT NULL DEFAULT '') STRICT;
CREATE TABLE touch (session INTEGER NOT NULL REFERENCES session(id), number INTEGER NOT NULL,
  joint_rad BLOB NOT NULL, target TEXT NOT NULL, held_out INTEGER NOT NULL, sigma_m REAL NOT NULL,
  radius_m REAL NOT NULL, tracker_m BLOB NOT NULL, time TEXT NOT NULL, settled_rad BLOB NOT NULL,
  readings INTEGER NOT NULL, spread_m REAL NOT NULL, speed_m_s REAL NOT NULL,
  UNIQUE (session, number)) STRICT;
CREATE TABLE reading (session INTEGER NOT NULL REFERENCES session(id), touch INTEGER NOT NULL,
  number INTEGER NOT NULL, slow INTEGER NOT NULL, contact_rad BLOB NOT NULL,
  settled_rad BLOB NOT NULL, along_m REAL NOT NULL, time_sigma_s REAL NOT NULL,
  reaction_s REAL NOT NULL, bounces INTEGER NOT NULL, time TEXT NOT NULL) STRICT;
CREATE TABLE event (session INTEGER NOT NULL REFERENCES session(id), time TEXT NOT NULL,
  words TEXT NOT NULL) STRICT;
CREATE INDEX event_of_session ON event (session);
CREATE INDEX reading_of_session ON reading (session);
CREATE TABLE chain (number INTEGER PRIMARY KEY, session INTEGER NOT NULL, kind TEXT NOT NULL,
  row INTEGER NOT NULL, digest TEXT NOT NULL, sum TEXT NOT NULL) STRICT;
CREATE INDEX chain_of_session ON chain (session, kind);
PRAGMA application_id = 0x6363616c;
PRAGMA user_version = 2;
)sql";

/// Writes rows and their chain as that version did.
class Version2 {
 public:
  explicit Version2(const std::filesystem::path& path) : database_(path), path_(path) {
    database_.execute("PRAGMA journal_mode = WAL");
    database_.execute(kVersion2);
    append(0, "journal", 0, "the name of this journal");
  }

  void insert(std::int64_t session, const std::string& table, const std::string& values) {
    database_.execute(("INSERT INTO " + table + " VALUES (" + values + ")").c_str());
    const std::int64_t row = database_.last_row_id();
    Statement written(database_, ("SELECT rowid, * FROM " + table + " WHERE rowid=?").c_str());
    written.bind(1, row).step();
    append(session, table, row, calib::sha256(bytes_of(written.values())));
  }

  /// As the commit behind the last row.
  void write_head() { HeadFile(path_.string() + ".head", path_).write(newest_); }

 private:
  void append(std::int64_t session, const std::string& kind, std::int64_t row,
              const std::string& digest) {
    const std::int64_t number = newest_.entries + 1;
    const std::string sum = calib::sha256(
        fmt::format("{} {} {} {} {} {}", newest_.sum, number, session, kind, row, digest));
    Statement entry(database_, "INSERT INTO chain VALUES (?,?,?,?,?,?)");
    entry.bind(1, number).bind(2, session).bind(3, std::string_view(kind)).bind(4, row);
    entry.bind(5, std::string_view(digest)).bind(6, std::string_view(sum)).step();
    newest_ = {number, sum};
  }

  Database database_;
  std::filesystem::path path_;
  Head newest_;
};

/// One session that is done, with two touches, a reading and an event; and one in its midst.
inline void make_version_2(const std::filesystem::path& path) {
  Version2 old(path);
  const auto session = [&](int id, const char* state, const char* calibration) {
    old.insert(
        id, "session",
        fmt::format("{}, 't0', 't1', '{}', '/c', 'cell', '/r', 'robot', '{{}}', 'h', 2, '', '{}'",
                    id, state, calibration));
  };
  const auto touch = [&](int of, int number) {
    old.insert(of, "touch",
               fmt::format("{}, {}, x'9a9999999999b93f000000000000f07f', 'S{}', {}, 1e-5, 0.25, "
                           "x'000000000000f03f00000000000000400000000000000840', 't', "
                           "x'555555555555d5bf', 3, 0.14285714285714285, 0.002",
                           of, number, number + 1, number % 2));
  };
  session(1, "done", "{}");
  touch(1, 0);
  touch(1, 1);
  old.insert(1, "reading", "1, 0, 0, 0, x'', x'555555555555d5bf', 0.0125, 1e-6, 0.02, 2, 't'");
  old.insert(1, "event", "1, 't', 'transit -> arming fast on arrived'");
  session(2, "running", "");
  touch(2, 0);
  old.write_head();
}

}  // namespace cellcal::daemon::testing
