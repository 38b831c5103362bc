#pragma once
// Session as recorded in the journal.

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
  std::string words;        ///< description of the calibration
  bool accepted = false;    ///< a changed arm had to be accepted
  std::string calibration;  ///< JSON
};

/// Puts a session's calibration into use although a newer one was published.
struct Activation {
  std::int64_t session = 0;
  std::string time, who, reason;
  std::int64_t entry = 0;  ///< position among all entries; 0: not written yet
};

/// State of a session.
enum class RecordState {
  kRunning,
  kInterrupted,  ///< not running and not ended
  kAborted,
  kFailed,
  kDone,
  kDamaged,  ///< the row was changed or is missing
};
inline constexpr auto kRecordStates = all_values<RecordState>();

/// "running", as in the database and the API.
constexpr const char* to_string(RecordState state) { return own_name(state); }
/// Returns kDamaged for an unknown text.
RecordState record_state_of(std::string_view text);

struct SessionRecord {
  std::int64_t id = 0;
  std::string started, ended;  ///< ISO 8601 UTC; `ended` is empty while it runs
  RecordState state = RecordState::kRunning;
  SessionInputs inputs;
  std::string plan_hash;
  int planned = 0;               ///< touches of the plan; 0 before planning
  int touches = 0;               ///< on disk
  std::string failure;           ///< to_journal(RecordEnd::why); empty: none
  calib::Phrase failure_said{};  ///< likewise, for other languages; empty: not recorded
  std::optional<FailureKind> failure_kind{};  ///< set for the report of a failure; not stored
  std::string calibration;                    ///< JSON; empty before identification
  bool has_calibration = false;               ///< even if it was not read with the record
  std::optional<SessionOutcome> outcome{};    ///< for a session that is done
  std::string document;          ///< JSON of a completed check, qualification or search of spheres
  std::string software;          ///< version of the program at its start
  std::optional<Origin> origin;  ///< imported
  std::string
      dropped;  ///< time of deletion of its raw events and readings (retention); empty: not deleted

  /// As recorded in English, where it was not recorded for other languages.
  std::string failure_words(const calib::Language& language) const;
  /// True if the session is not complete and its plan can be continued.
  bool resumable() const {
    return state != RecordState::kDone && state != RecordState::kRunning && !origin;
  }
};

}  // namespace cellcal::daemon
