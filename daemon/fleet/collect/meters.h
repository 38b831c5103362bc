#pragma once
// How much each cell may send. Each has a store of messages and of bytes that fills by time.

#include <chrono>
#include <map>

#include "daemon/plant/messages/names.h"

namespace cellcal::daemon::fleet {

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

}  // namespace cellcal::daemon::fleet
