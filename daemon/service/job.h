#pragma once
// A session ready to begin: inputs read and checked, backend created. Nothing is opened or moved yet.

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
#include "daemon/service/time_left.h"
#include "daemon/service/touch_news.h"
#include "daemon/session/state.h"
#include "daemon/tasks/options.h"

namespace cellcal::daemon {

/// Everything that one session owns until it has ended.
struct Job {
  std::int64_t session = 0;  ///< 0: not in the journal yet
  calib::Cell cell;
  SessionInputs inputs;
  SessionOptions options;
  SessionSettings settings;
  std::string started;
  std::string last_ended;     ///< of an update: end of the session that it is based on
  std::string expected_hash;  ///< of a resumed session's plan
  bool resumed = false;
  std::string unattended;
  std::vector<std::string> warnings;                  ///< non-fatal findings in the cell file
  std::shared_ptr<const calib::SearchUnderWay> left;  ///< unfinished search of the previous session
  std::vector<calib::Touch> touches;                  ///< made before the session was resumed
  std::unique_ptr<Backend> backend;
  std::optional<HandSpeed> hand_speed;  ///< none: an emulated cell
  TouchPublication news;
  TimeLeft time_left;
};

/// Throws RequestError, JournalError, calib::FileError, drivers::ConfigError, drivers::DriverError.
std::unique_ptr<Job> prepare(Journal& journal, const RunRequest& request, SessionSettings settings,
                             const MakeBackend& make_backend);

/// Initial state of the sequence.
State first_state(const Job& job);

}  // namespace cellcal::daemon
