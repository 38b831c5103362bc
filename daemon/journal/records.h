#pragma once
// A session as the journal has it.

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "calib/model/enum_table.h"
#include "daemon/journal/chain.h"
#include "daemon/result/outcome.h"
#include "daemon/session/failure.h"

namespace cellcal::daemon {

/// Input files of a session as text, so that it can be resumed after the files have changed.
struct SessionInputs {
  std::string cell_name, cell_text;  ///< the file's path as given, and its content
  std::string robot_name, robot_text;
  std::string options;  ///< JSON, options.h
};

/// The earlier calibration that a result was compared with.
struct Compared {
  std::string words;        ///< which one
  bool accepted = false;    ///< a changed arm was to be accepted
  std::string calibration;  ///< JSON
};

/// Puts a session's calibration into use although a newer one was published.
struct Activation {
  std::int64_t session = 0;
  std::string time, who, reason;
  std::int64_t entry = 0;  ///< its place among all that was ever written; 0: not written yet
};

/// How far a session came.
enum class RecordState {
  kRunning,
  kInterrupted,  ///< not running and not ended
  kAborted,
  kFailed,
  kDone,
  kDamaged,  ///< the row was changed or is missing
};
inline constexpr auto kRecordStates = all_values<RecordState>();

/// "running", "interrupted", "aborted", "failed", "done", "damaged": as the database and the API have them.
const char* to_string(RecordState state);
/// Returns kDamaged for an unknown text.
RecordState record_state_of(std::string_view text);

struct SessionRecord {
  std::int64_t id = 0;
  std::string started, ended;  ///< ISO 8601 UTC; `ended` is empty while it runs
  RecordState state = RecordState::kRunning;
  SessionInputs inputs;
  std::string plan_hash;
  int planned = 0;                            ///< touches of the plan; 0 before it was made
  int touches = 0;                            ///< on disk
  std::string failure;                        ///< to_journal(Failure); empty: it did not fail
  std::optional<FailureKind> failure_kind{};  ///< set for the report of a failure; not stored
  std::string calibration;                    ///< JSON; empty before identification
  bool has_calibration = false;               ///< whether or not it was read with the record
  std::optional<SessionOutcome> outcome{};    ///< of one that is done
  std::string document;          ///< JSON of a check, a qualification or found spheres that is done
  std::string software;          ///< version that began it
  std::optional<Origin> origin;  ///< imported
  std::string
      dropped;  ///< when its raw events and readings were dropped (retention); empty: they are there

  /// It has not come to its end, and its plan can be gone on with.
  bool resumable() const {
    return state != RecordState::kDone && state != RecordState::kRunning && !origin;
  }
};

}  // namespace cellcal::daemon
