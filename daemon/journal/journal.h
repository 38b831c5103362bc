#pragma once
// The journal of all sessions: inputs, touches, readings, what happened, how it ended.

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "calib/model/touch.h"
#include "daemon/session/action.h"
#include "daemon/session/contact_delay.h"

namespace cellcal::daemon {

/// Something could not be put on disk or read from it. Names the file and says what to do.
struct JournalError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// What a session works on, as text, so that it can be resumed when the files have changed.
struct SessionInputs {
  std::string cell_name, cell_text;  ///< the file's path as given, and its content
  std::string robot_name, robot_text;
  std::string options;  ///< JSON, options.h
};

struct SessionRecord {
  std::int64_t id = 0;
  std::string started, ended;  ///< ISO 8601 UTC; `ended` is empty while it runs
  /// running, interrupted, aborted, failed, done; damaged: the row is not as it was written.
  std::string state;
  SessionInputs inputs;
  std::string plan_hash;
  int planned = 0;  ///< touches of the plan; 0 before it was made
  int touches = 0;  ///< on disk
  std::string failure;
  std::string calibration;  ///< JSON; empty before identification

  /// It has not come to its end, and its plan can be gone on with.
  bool resumable() const { return state != "done" && state != "running"; }
};

class Journal {
 public:
  /// Opens or creates the file; takes one of an earlier version over. Throws JournalError where
  /// another process has it, and where it is no journal or a damaged one.
  explicit Journal(const std::filesystem::path& path);
  ~Journal();
  Journal(const Journal&) = delete;
  Journal& operator=(const Journal&) = delete;

  /// What is to be said of the file though it was taken.
  const std::vector<std::string>& remarks() const;
  /// The file and those that belong to it. None of them is anybody's input.
  std::vector<std::filesystem::path> files() const;
  /// Throws JournalError where the files that are written to are no longer those that others see.
  void check();

  std::int64_t begin(const SessionInputs& inputs, const std::string& utc);
  /// Makes an unfinished session the running one again.
  void resume(std::int64_t session, const std::string& utc);
  void record(std::int64_t session, const RecordPlan& plan);
  void record(std::int64_t session, const RecordReading& reading);
  void record(std::int64_t session, const RecordTouch& touch);
  void record(std::int64_t session, const RecordEnd& end, const std::string& utc);
  void store_calibration(std::int64_t session, const std::string& json);
  /// Written with the next row of this journal. Never waits for the disk.
  void note(std::int64_t session, const std::string& utc, const std::string& words);

  // What is read of one session was compared with its checksums; JournalError where it is not what
  // was written.

  /// Newest first, without the texts of the inputs and the calibration.
  std::vector<SessionRecord> sessions();
  std::optional<SessionRecord> session(std::int64_t id);
  std::optional<SessionRecord> newest_resumable();
  std::vector<calib::Touch> touches(std::int64_t session);
  std::vector<std::string> events(std::int64_t session);
  int reading_count(std::int64_t session);
  /// Of the touches that were recorded, their contacts at both speeds.
  std::vector<FastAndSlow> contacts(std::int64_t session);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace cellcal::daemon
