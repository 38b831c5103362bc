#pragma once
// Differences between the kinds of session, from the request to the result: one file each.

#include <memory>
#include <optional>
#include <string>

#include "daemon/service/job.h"
#include "daemon/tasks/tasks.h"

namespace cellcal::daemon {

class Kind {
 public:
  /// Parameters that a request for it may have.
  struct Parameters {
    bool touches = false, goal = false, find = false, seed = false;
    bool target = false;       ///< of a qualification
    bool compares = false;     ///< calibration, temperature_c and mastered, of a check
    const char* refusal = "";  ///< of touches, goal or find that it does not take
  };

  virtual ~Kind() = default;

  virtual Parameters parameters() const = 0;
  /// As anew(), without the load.
  virtual std::string command(const SessionOptions&, const SessionInputs&) const { return ""; }

  /// Inputs of a new session, and options that the request does not state. By default the files of the request's cell.
  /// Throws RequestError, JournalError, calib::FileError.
  virtual void begin(Journal& journal, const RunRequest& request, Job& job) const;
  /// Calibration that the result is compared with. Throws NotUsable, JournalError.
  virtual std::optional<Compared> compared(Journal&, const Job&) const { return std::nullopt; }
  /// True where touches are chosen one by one. By default true.
  virtual bool chooses(const Job&) const { return true; }
  /// Checks of a new session, before anything is opened, planned or moved. Throws RequestError.
  virtual void examine(const Job&) const {}
  /// Upper bound of the share of the robot file's axis speeds, whatever the configuration allows.
  virtual double most_speed() const { return 1.0; }

  virtual void adapt(State&, const Job&) const {}
  /// Throws NotUsable, JournalError.
  virtual void add_inputs(TaskInputs&, Journal&, const Job&) const {}
  /// Throws calib::IdentifyError.
  virtual Tasks tasks(const SharedInputs& inputs) const = 0;
};

/// `update`: as in SessionOptions; an update is a kind of its own.
const Kind& kind_of(SessionKind kind, bool update);
inline const Kind& kind_of(const SessionOptions& options) {
  return kind_of(options.kind, options.update);
}

/// Command that begins the same session anew, where its kind is not resumed; empty: it is resumed.
std::string anew(const SessionOptions& options, const SessionInputs& inputs);

const Kind& calibration_kind();
const Kind& update_kind();
const Kind& check_kind();
const Kind& qualification_kind();
const Kind& find_kind();
const Kind& dry_run_kind();

// Shared by check and update.

/// Session record of a calibration. Throws RequestError where its cell file has changed since.
SessionRecord unchanged(SessionRecord record);

/// The calibration predicts every contact, so only the first (for the latch's delay) and surprising ones are
/// confirmed.
void expect_contacts(State& first, const calib::Cell& cell);

}  // namespace cellcal::daemon
