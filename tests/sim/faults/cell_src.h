#pragma once
// CELL.SRC in EXT, from the PLC's point of view: requests a program number (PGNO_REQ), calls the program of the
// number received, and requests again after its return. Without sockets, threads or clock.

#include <functional>

#include "drivers/time.h"

namespace cellcal::sim {

class CellSrc {
 public:
  static constexpr int kCellcal = 90, kBrakeTest = 91;

  struct Programs {
    std::function<void()> call;      ///< starts cellcal's program
    std::function<bool()> returned;  ///< true if it is not active
    /// True if it is stopped with a message: CELL is stopped with it, until restarted.
    std::function<bool()> stands;
    std::function<void(bool)> request;  ///< $BRAKETEST_REQ_INT changes
    std::function<void()> test_arm;     ///< motion of a brake test
  };
  CellSrc(Programs programs, drivers::Duration brake_test);

  /// Selected, BCO done, $EXT_START; after a message: acknowledged, reset and restarted.
  void start();
  /// Stopped and reset by the PLC in any state.
  void leave();
  void tick(drivers::TimePoint now);
  bool asks() const { return runs_ == Runs::kAsks; }
  /// PGNO with PGNO_VALID. False: no request, or no such CASE (PGNO_FAULT).
  bool number(int pgno, drivers::TimePoint now);

  void request_brake_test();
  bool brake_test_requested() const { return requested_; }
  int brake_tests() const { return tests_; }

 private:
  enum class Runs { kNothing, kAsks, kCellcal, kBrakeTest };

  Programs programs_;
  drivers::Duration brake_test_;
  drivers::TimePoint until_{};
  Runs runs_ = Runs::kNothing;
  bool requested_ = false;
  int tests_ = 0;
};

}  // namespace cellcal::sim
