#pragma once
// Whether a cell is there: retained by the broker, "cellcal.presence/1".

#include <cstdint>
#include <string>
#include <string_view>

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

}  // namespace cellcal::daemon::plant
