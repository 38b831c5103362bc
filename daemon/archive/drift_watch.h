#pragma once
// The checks of the newest published calibration as a control chart, kept until another check has ended.

#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <string>

#include "calib/result/drift_chart.h"
#include "daemon/journal/journal.h"

namespace cellcal::daemon {

struct Drift {
  std::int64_t calibrated = 0;      ///< the session of the calibration
  std::string cell, calibrated_at;  ///< its cell file; when it ended, ISO 8601 UTC
  calib::DriftChart chart;
};

class DriftWatch {
 public:
  /// Seconds since 1970, UTC.
  using Now = std::function<double()>;
  explicit DriftWatch(Journal& journal, Now now = wall_clock_s)
      : journal_(journal), now_(std::move(now)) {}

  /// Of this cell file, of any where it is empty. Null: it has no published calibration. Any thread. Throws
  /// NotUsable where the one in use is damaged; JournalError.
  std::shared_ptr<const Drift> look(const std::filesystem::path& cell = {});

 private:
  static double wall_clock_s();

  Journal& journal_;
  Now now_;
  std::mutex mutex_;
  std::string of_;  ///< which sessions `newest_` was made of
  std::shared_ptr<const Drift> newest_;
};

}  // namespace cellcal::daemon
