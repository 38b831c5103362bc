#pragma once
// What the schedule must not forget when the daemon ends: on disk before anything begins, so that nothing begins
// twice. Format "cellcal.schedule/1".

#include <deque>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "daemon/schedule/decision.h"

namespace cellcal::daemon {

/// That is decided for good: begun, refused or missed.
struct ClosedNight {
  std::string entry, night;
  bool missed = false;  ///< nothing was begun: a clock that is set back may bring it again
};

struct ScheduleState {
  UtcSeconds looked = 0;                    ///< everything before this has been looked at
  std::map<std::string, UtcSeconds> known;  ///< since when an entry is
  std::deque<ClosedNight> closed;           ///< newest last
  std::optional<std::int64_t> aborted;      ///< 'abort' was given when this was the newest session
  std::string released;                     ///< the end behind which somebody has looked (Standing::end)
  std::string harmless;                     ///< the end behind which another may begin
  std::deque<Decision> decisions;           ///< newest last

  bool is_closed(const std::string& entry, const std::string& night) const;
  void close(const std::string& entry, const std::string& night, bool missed);
  void reopen_missed(const std::string& entry, const std::string& night);
  void add(Decision decision);
};

/// As it was; a new one where there is no file. Throws std::runtime_error, which names the file, where it is damaged.
ScheduleState load_schedule_state(const std::filesystem::path& file);
/// On disk when it returns. Throws std::runtime_error.
void save(const ScheduleState& state, const std::filesystem::path& file);

}  // namespace cellcal::daemon
