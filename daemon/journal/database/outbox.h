#pragma once
// What a journal tells others of its facts: rows that wait until somebody has acknowledged them, each written in
// the transaction of the fact that it reports. What stands in them is the reporter's to say.

#include <cstdint>
#include <string>
#include <vector>

#include "daemon/journal/database/records.h"
#include "daemon/session/action.h"
#include "daemon/session/evidence.h"

namespace cellcal::daemon {

/// Telemetry may be dropped where there is no room; results never are.
enum class Worth { kResult, kTelemetry };

struct Report {
  std::string kind;
  Worth worth = Worth::kResult;
  /// Empty: composed by Reporter::calibration() when it is read, so that a calibration is not on disk twice.
  std::string body;
};

/// From a fact to what is told of it. Called with the journal's lock held: waits for nobody. What it throws costs
/// the report, never the fact.
class Reporter {
 public:
  virtual ~Reporter() = default;
  /// It began, goes on, was found interrupted, or ended. Without texts.
  virtual std::vector<Report> session(const SessionRecord& session) const = 0;
  /// Of the text in `calibration`; `touches`: the session's.
  virtual Report calibration(const SessionRecord& session,
                             const std::vector<calib::Touch>& touches) const = 0;
  virtual std::vector<Report> touch(const RecordTouch& touch) const = 0;
  virtual std::vector<Report> change(const RecordChange& change) const = 0;
  virtual std::vector<Report> activation(const Activation& activation) const = 0;
  /// So many numbers from `first` to `last` are gone.
  virtual Report dropped(std::int64_t first, std::int64_t last, std::int64_t count) const = 0;
  /// Under which name this journal speaks; empty: none. From another one on numbers begin anew under another source.
  virtual std::string address() const { return {}; }
  /// Whether what was written under that name is told now; what is not waits.
  virtual bool tells_of(const std::string& /*address*/) const { return true; }
  /// Of what waits; beyond that the oldest telemetry goes.
  virtual std::int64_t most_bytes() const = 0;
  /// Something new waits.
  virtual void waits() const {}
};

struct WaitingReport {
  std::int64_t row = 0;     ///< for Journal::acknowledge()
  std::string source;       ///< whose numbers these are
  std::int64_t number = 0;  ///< counts up by one, never used twice under this source
  std::int64_t session = 0;
  std::string time;
  Report report;
};

/// What was found of a touch that is on disk.
struct AssessedTouch {
  std::size_t index = 0;
  double residual_m = 0.0;
};

struct OutboxCount {
  std::string source;       ///< of the next
  std::int64_t newest = 0;  ///< number under that source; 0: none yet
  std::int64_t rows = 0, bytes = 0, telemetry_bytes = 0;
  /// Since the journal was opened: dropped, and not begun because results alone fill it.
  std::int64_t dropped = 0, not_begun = 0;
  std::string oldest;  ///< time of the oldest that waits, ISO 8601 UTC; empty: none
  /// Of what waits: written under another name, which nobody is told of now.
  std::int64_t elsewhere = 0;
  std::string elsewhere_address;  ///< of these the oldest
};

}  // namespace cellcal::daemon
