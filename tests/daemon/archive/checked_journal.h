#pragma once
// A journal with a published calibration of a simulated arm, and checks of it.

#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <string>

#include "calib/result/tcp_check.h"
#include "daemon/journal/journal.h"
#include "daemon/tasks/options.h"
#include "tests/daemon/journal/temporary_directory.h"

namespace cellcal::daemon::testing {

class CheckedJournal {
 public:
  CheckedJournal();

  struct Check {
    Eigen::Vector3d shift_m = Eigen::Vector3d::Zero();     ///< of the tool
    std::optional<calib::TcpCheck> result = that_holds();  ///< none: no outcome is recorded
    std::optional<double> temperature_c = {};
    bool ends = true;
    bool other_touches = false;
    std::string ended = {};  ///< recorded end; empty: the time
  };
  static calib::TcpCheck that_holds();
  /// A check with this TCP shift, attributed to this change; U(k=2) is 0.05 mm.
  static calib::TcpCheck that_does_not_hold(calib::ChangeKind change,
                                            const Eigen::Vector3d& shift_m = {0.8e-3, -0.5e-3,
                                                                              0.3e-3});
  /// One shift (8 h) after the preceding one. Returns its session.
  std::int64_t check(const Check& how);
  std::int64_t check() { return check(Check{}); }
  struct Files {
    std::string cell = "c", robot = "r";
  };
  /// Like a published session of the same cell.
  std::int64_t calibrate(const SessionOptions& options, const Files& files);
  std::int64_t calibrate() { return calibrate({}, {}); }
  std::filesystem::path results_dir(std::int64_t session) const;

  TemporaryDirectory dir;
  Journal journal{dir / "journal.db"};
  std::int64_t calibrated = 0;

 private:
  std::string next_utc();
  unsigned made_ = 0;
};

}  // namespace cellcal::daemon::testing
