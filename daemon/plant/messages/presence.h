#pragma once
// Whether a cell is there: retained by the broker, "cellcal.presence/1".

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "daemon/plant/messages/names.h"

namespace cellcal::daemon::plant {

struct Presence {
  CellName of;
  bool online = false;
  bool farewell = false;  ///< an orderly end, not a line that was lost
  std::string journal;
  std::int64_t number = 0;  ///< of the newest fact when it connected
  std::string software;
  std::string
      time;  ///< when it connected, or ended; of a will: when it had connected. ISO 8601 UTC
  bool mock = false;  ///< the cell is emulated

  bool operator==(const Presence&) const = default;
};

std::string to_json(const Presence& presence);
/// Throws calib::FileError.
Presence presence_from_json(std::string_view json, const Topic& topic);

// Which facts of a journal are in the plant's database, "cellcal.stored/1": only then a result leaves its cell. A broker's
// acknowledgement is not enough, as one that is killed has lost what it had acknowledged and not saved.

struct Stored {
  CellName of;
  std::string journal;
  /// From and to, both stored; ascending. The newest only where there are many: older ones were told before.
  std::vector<std::pair<std::int64_t, std::int64_t>> numbers;

  bool has(std::int64_t number) const;
  bool operator==(const Stored&) const = default;
};

inline constexpr std::size_t kMostStoredRanges = 200;

std::string to_json(const Stored& stored);
/// Throws calib::FileError.
Stored stored_from_json(std::string_view json, const Topic& topic);

}  // namespace cellcal::daemon::plant
