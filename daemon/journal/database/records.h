#pragma once
// A session as the journal has it.

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "daemon/journal/database/origin.h"
#include "daemon/result/outcome.h"
#include "daemon/session/failure.h"

namespace cellcal::daemon {

/// What a session works on, as text, so that it can be resumed when the files have changed.
struct SessionInputs {
  std::string cell_name, cell_text;  ///< the file's path as given, and its content
  std::string robot_name, robot_text;
  std::string options;  ///< JSON, options.h
};

/// The earlier calibration that a result was held against.
struct Compared {
  std::string words;        ///< which one
  bool accepted = false;    ///< a changed arm was to be accepted
  std::string calibration;  ///< JSON
};

/// A person's word that this session's calibration is to be used, though a newer one was published.
struct Activation {
  std::int64_t session = 0;
  std::string time, who, reason;
  std::int64_t entry = 0;  ///< its place among all that was ever written; 0: not written yet
};

/// How far a session came.
enum class RecordState {
  kRunning,
  kInterrupted,  ///< nobody runs it, and it did not come to its end
  kAborted,
  kFailed,
  kDone,
  kDamaged,  ///< the row is not as it was written, or missing
};
inline constexpr std::array kRecordStates{RecordState::kRunning, RecordState::kInterrupted,
                                          RecordState::kAborted, RecordState::kFailed,
                                          RecordState::kDone,    RecordState::kDamaged};

/// "running", "interrupted", "aborted", "failed", "done", "damaged": as the database and the API have them.
const char* to_string(RecordState state);
/// Of text that no version wrote: kDamaged.
RecordState record_state_of(std::string_view text);

struct SessionRecord {
  std::int64_t id = 0;
  std::string started, ended;  ///< ISO 8601 UTC; `ended` is empty while it runs
  RecordState state = RecordState::kRunning;
  SessionInputs inputs;
  std::string plan_hash;
  int planned = 0;      ///< touches of the plan; 0 before it was made
  int touches = 0;      ///< on disk
  std::string failure;  ///< to_journal(Failure); empty: it did not fail
  std::optional<FailureKind>
      failure_kind{};            ///< of one that fails now, for those who are told; no row has it
  std::string calibration;       ///< JSON; empty before identification
  bool has_calibration = false;  ///< whether or not it was read with the record
  std::optional<SessionOutcome> outcome{};  ///< of one that is done
  std::string document;  ///< JSON of a check, a qualification or found spheres that is done
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
