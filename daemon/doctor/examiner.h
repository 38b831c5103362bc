#pragma once
// The doctor within the daemon: one examination at a time, in a thread of its own.

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
  std::filesystem::path cell;  ///< empty: none was asked for, nor kept
  bool kept = false;           ///< by a daemon before this one
  bool running = false;
  bool whole = false;           ///< it came to its end
  std::string hint;             ///< what the person has to do now, while it runs
  std::string cell_text;        ///< of the cell file when it began; empty: not readable
  std::string ended;            ///< UTC
  std::vector<Finding> checks;  ///< so far

  std::size_t count(Outcome outcome) const;
  /// It came to its end and nothing FAILED.
  bool green() const { return whole && count(Outcome::kFailed) == 0; }
};

class Examiner {
 public:
  struct Parts {
    /// Looks at everything; tells of each finding, and of what has to be done, as it goes. Ends soon once asked to
    /// stop.
    std::function<void(const std::filesystem::path& cell, Findings& findings,
                       const std::function<void(const std::string&)>& hint, std::stop_token)>
        look;
    /// Keeps sessions from beginning until `release`; throws where one is under way.
    std::function<void()> hold;
    std::function<void()> release;
    std::function<std::string()> utc_now;
    /// Of the configuration in force.
    std::function<std::string()> config_sha256 = {};
    /// Where the newest whole one is kept, for the daemon after this one; empty: nowhere.
    std::filesystem::path file = {};
  };
  /// With the kept one, where it was made at the configuration in force now.
  explicit Examiner(Parts parts);
  ~Examiner();
  Examiner(const Examiner&) = delete;
  Examiner& operator=(const Examiner&) = delete;

  /// Begins one. Throws what `hold` throws.
  void begin(const std::filesystem::path& cell);
  /// What `cellcal doctor` found beside the daemon, at a configuration and a cell file of these digests. Not taken, with
  /// why, where they are not what is in force here now, or one is looking.
  enum class NotTaken { kOtherConfig, kOtherCell, kLooking };
  std::optional<NotTaken> take(const std::filesystem::path& cell, const std::string& cell_sha256,
                               const std::string& config_sha256, std::vector<Finding> checks);
  /// The newest, or what of it there is.
  Examination newest() const;
  /// Waits for its end, which is asked for; nothing begins any more.
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
