#pragma once
// Control chart of the checks of the calibration in use, cached until another check has ended.

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "calib/result/drift_chart.h"
#include "daemon/journal/journal.h"

namespace cellcal::daemon {

struct Drift {
  std::int64_t calibrated = 0;      ///< session of the calibration
  std::string cell, calibrated_at;  ///< cell file; end of its session, ISO 8601 UTC
  calib::DriftChart chart;
  calib::Standing standing;  ///< at the time of evaluate()
};

class DriftWatch {
 public:
  /// Seconds since 1970, UTC.
  using Now = std::function<double()>;
  explicit DriftWatch(Journal& journal, Now now = wall_clock_s)
      : journal_(journal), now_(std::move(now)) {}

  /// For this cell file, or for any where it is empty. Null: no published calibration. Thread-safe. Throws
  /// NotUsable where the one in use is damaged; JournalError.
  std::shared_ptr<const Drift> evaluate(const std::filesystem::path& cell = {});

 private:
  static double wall_clock_s();

  Journal& journal_;
  Now now_;
  std::mutex mutex_;
  std::string of_;  ///< key of `newest_`: its sessions and activations
  std::shared_ptr<const Drift> newest_;
};

}  // namespace cellcal::daemon
