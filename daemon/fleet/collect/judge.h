#pragma once
// What a message is.

#include <chrono>
#include <map>
#include <string>

#include "daemon/fleet/store/batch.h"
#include "daemon/plant/messages/names.h"

namespace cellcal::daemon::fleet {

// How much each cell may send. Each has a store of messages and of bytes that fills by time.

struct Allowance {
  double messages_per_s = 20.0;
  double burst = 50'000.0;  ///< messages; a week offline with one health fact a minute has 10 080
  double bytes_per_day = 1.0e9;  ///< as many at once, too
};

/// One thread.
class Meters {
 public:
  using Time = std::chrono::steady_clock::time_point;

  explicit Meters(Allowance allowance) : allowance_(allowance) {}
  /// False: it has used up what it may. A message without a cell counts to one that all such share.
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

/// Puts it into the batch as what it is. Throws nothing but std::bad_alloc.
void judge(Message message, Meters& meters, Meters::Time now, Batch& batch);

/// "2026-11-22T20:51:17.123Z", a day that there is, in the years 1970 to 9999.
bool is_time(std::string_view text);

}  // namespace cellcal::daemon::fleet
