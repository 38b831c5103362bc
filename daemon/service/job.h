#pragma once
// A session that can begin: its files read and looked at, its arm and sensor made. Nothing is opened or moved yet.

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "calib/model/robot.h"
#include "calib/model/touch.h"
#include "daemon/journal/journal.h"
#include "daemon/service/hand_speed.h"
#include "daemon/service/request.h"
#include "daemon/service/settings.h"
#include "daemon/service/time_left.h"
#include "daemon/service/touch_news.h"
#include "daemon/session/state.h"
#include "daemon/tasks/options.h"

namespace cellcal::daemon {

/// All that one session needs, until it has ended.
struct Job {
  std::int64_t session = 0;  ///< 0: not in the journal yet
  calib::Cell cell;
  SessionInputs inputs;
  SessionOptions options;
  SessionSettings settings;
  std::string started;
  std::string last_ended;     ///< of an update: when the session that it stands on ended
  std::string expected_hash;  ///< of a resumed session's plan
  bool resumed = false;
  std::string unattended;
  std::vector<std::string> warnings;  ///< what the cell file says against itself, not refused
  std::shared_ptr<const calib::SearchUnderWay> left;  ///< unfinished, by the session before
  std::vector<calib::Touch> touches;                  ///< made before it was resumed
  std::unique_ptr<Backend> backend;
  std::optional<HandSpeed> hand_speed;  ///< none: an emulated cell
  TouchNews news;
  TimeLeft time_left;
};

/// Throws RequestError, JournalError, calib::FileError, drivers::ConfigError, drivers::DriverError.
std::unique_ptr<Job> prepare(Journal& journal, const RunRequest& request, SessionSettings settings,
                             const MakeBackend& make_backend);

/// Where the sequence begins.
State first_state(const Job& job);

}  // namespace cellcal::daemon
