#pragma once
// The doctor within the daemon: one examination at a time, on a thread of its own.

#include <filesystem>
#include <functional>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include "daemon/doctor/finding.h"

namespace cellcal::daemon {

struct Examination {
  std::filesystem::path cell;  ///< empty: none requested or stored
  bool kept = false;           ///< by an earlier daemon process
  bool running = false;
  bool whole = false;           ///< completed
  std::string hint;             ///< required operator action while it runs
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
                       const std::function<void(const std::string&)>& hint, std::stop_token)>
        look;
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
  enum class NotTaken { kOtherConfig, kOtherCell, kLooking };
  std::optional<NotTaken> take(const std::filesystem::path& cell, const std::string& cell_sha256,
                               const std::string& config_sha256, std::vector<Finding> checks);
  /// The newest, possibly incomplete.
  Examination newest() const;
  /// Stops the current examination and waits for its end; none begins afterwards.
  void stop();

 private:
  void examine(const std::filesystem::path& cell, const std::stop_token& stop);
  Examination kept() const;
  void keep(const Examination& whole) const;

  Parts parts_;
  mutable std::mutex mutex_;
  Examination newest_;
  bool ending_ = false;
  std::jthread thread_;
};

}  // namespace cellcal::daemon
