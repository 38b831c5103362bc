#pragma once
// Classifies messages.

#include <chrono>
#include <map>
#include <string>

#include "daemon/fleet/batch.h"
#include "daemon/plant/messages/text_fields.h"

namespace cellcal::daemon::fleet {

// Rate limit of each cell: token buckets of messages and bytes.

struct Allowance {
  double messages_per_s = 20.0;
  double burst = 50'000.0;  ///< messages; a week offline with one health fact a minute has 10 080
  double bytes_per_day = 1.0e9;  ///< also the largest burst
};

/// For use by one thread.
class Meters {
 public:
  using Time = std::chrono::steady_clock::time_point;

  explicit Meters(Allowance allowance) : allowance_(allowance) {}
  /// False if the cell's allowance is used up. Messages without a cell share one allowance.
  bool allows(const plant::CellName& cell, std::size_t bytes, Time now);

 private:
  struct Meter {
    double messages = 0.0, bytes = 0.0;  ///< left
    Time at;
  };
  Meter& meter_of(const plant::CellName& cell, Time now);

  Allowance allowance_;
  std::map<plant::CellName, Meter> meters_;
};

struct Message {
  std::string topic, payload;
};

/// Adds the message to the batch. Throws only std::bad_alloc.
void judge(Message message, Meters& meters, Meters::Time now, Batch& batch);

/// True for a time such as "2026-11-22T20:51:17.123Z", with a valid date in the years 1970 to 9999.
bool is_time(std::string_view text);

}  // namespace cellcal::daemon::fleet
