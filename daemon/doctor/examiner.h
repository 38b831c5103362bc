#pragma once
// The doctor within the daemon: one examination at a time, on a thread of its own.

#include <filesystem>
#include <functional>
#include <mutex>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include "calib/words/phrase.h"

namespace cellcal::daemon {

// Result of a check, with its remedy.

enum class Outcome {
  kOk,
  kWarning,  ///< works, but could be better or safer
  kFailed,   ///< must be resolved before the arm moves
  kSkipped,  ///< not checked, because of another failure or missing input
};

/// "ok", "warning", "FAILED", "skipped".
const char* to_string(Outcome outcome);

/// What a device says of itself; the phrase where it says nothing.
calib::Phrase or_else(const calib::Phrase& said, const char* fallback);

struct Finding {
  std::string check;  ///< name of the check: "rsi packets"
  Outcome outcome = Outcome::kOk;
  calib::Phrase found;
  calib::Phrase advice;  ///< remedy; empty for kOk
};
/// With "check", "outcome" (lower case), "found", "advice" in words, and "said" with both as phrases, as in
/// `cellcal doctor --json` and the API.
nlohmann::json to_json(const Finding& finding, const calib::Language& language = {});
/// From the phrases, and without them from the words. Throws nlohmann::json::exception; std::invalid_argument
/// for an unknown outcome and what is not a phrase.
Finding finding_of(const nlohmann::json& value);

/// Findings of one examination, passed to a listener as they arise.
class Findings {
 public:
  using Listener = std::function<void(const Finding&)>;

  explicit Findings(Listener listener = {}) : listener_(std::move(listener)) {}

  void ok(const std::string& check, const calib::Phrase& found) {
    add({check, Outcome::kOk, found, ""});
  }
  void warn(const std::string& check, const calib::Phrase& found, const calib::Phrase& advice) {
    add({check, Outcome::kWarning, found, advice});
  }
  void fail(const std::string& check, const calib::Phrase& found, const calib::Phrase& advice) {
    add({check, Outcome::kFailed, found, advice});
  }
  void skip(const std::string& check, const calib::Phrase& why) {
    add({check, Outcome::kSkipped, why, ""});
  }

  const std::vector<Finding>& all() const { return all_; }
  std::size_t count(Outcome outcome) const;
  /// No failure. Warnings are allowed.
  bool green() const { return count(Outcome::kFailed) == 0; }

 private:
  void add(Finding finding);

  Listener listener_;
  std::vector<Finding> all_;
};

struct Examination {
  std::filesystem::path cell;  ///< empty: none requested or stored
  bool running = false;
  bool whole = false;           ///< completed
  calib::Phrase hint;           ///< required operator action while it runs
  std::string cell_text;        ///< content of the cell file at the begin; empty: unreadable
  std::string ended;            ///< UTC
  std::vector<Finding> checks;  ///< so far

  std::size_t count(Outcome outcome) const;
  /// Completed without failures.
  bool green() const { return whole && count(Outcome::kFailed) == 0; }
};

class Examiner {
 public:
  struct Parts {
    /// Runs all checks; reports each finding and required operator action as it arises. Ends soon after a
    /// stop request.
    std::function<void(const std::filesystem::path& cell, Findings& findings,
                       const std::function<void(const calib::Phrase&)>& hint, std::stop_token)>
        run_checks;
    /// Prevents sessions from beginning until `release`; throws where one is under way.
    std::function<void()> hold;
    std::function<void()> release;
    std::function<std::string()> utc_now;
    /// Digest of the active configuration.
    std::function<std::string()> config_sha256 = {};
    /// File of the newest completed examination, for the next daemon process; empty: not stored.
    std::filesystem::path file = {};
  };
  /// Loads the stored examination if it was made with the active configuration.
  explicit Examiner(Parts parts);
  ~Examiner();
  Examiner(const Examiner&) = delete;
  Examiner& operator=(const Examiner&) = delete;

  /// Starts an examination. Throws as `hold` does.
  void begin(const std::filesystem::path& cell);
  /// Adopts the findings of `cellcal doctor`, with the digests of its configuration and cell file. Rejected,
  /// with the reason, where they differ from the active ones, or while an examination runs.
  enum class NotTaken { kOtherConfig, kOtherCell, kExamining };
  std::optional<NotTaken> take(const std::filesystem::path& cell, const std::string& cell_sha256,
                               const std::string& config_sha256, std::vector<Finding> checks);
  /// The newest, possibly incomplete.
  Examination newest() const;
  /// Stops the current examination and waits for its end; none begins afterwards.
  void stop();

 private:
  void examine(const std::filesystem::path& cell, const std::stop_token& stop);
  Examination kept() const;
  /// Adds a warning where it cannot be stored.
  void keep(Examination& whole) const;

  Parts parts_;
  mutable std::mutex mutex_;
  Examination newest_;
  bool ending_ = false;
  std::jthread thread_;
};

}  // namespace cellcal::daemon
