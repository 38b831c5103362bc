#pragma once
// CELL.SRC in EXT, as its PLC sees it: asks for a program number (PGNO_REQ), calls the program of the number that it
// is given, and asks again when that has returned. Without sockets, threads or clock.

#include <functional>

#include "drivers/time.h"

namespace cellcal::sim {

class CellSrc {
 public:
  static constexpr int kCellcal = 90, kBrakeTest = 91;

  struct Programs {
    std::function<void()> call;      ///< cellcal's own begins
    std::function<bool()> returned;  ///< it is not under way
    /// It stands with a message: CELL stands with it, until it is started again.
    std::function<bool()> stands;
    std::function<void(bool)> request;  ///< $BRAKETEST_REQ_INT changes
    std::function<void()> test_arm;     ///< what a brake test does with the arm
  };
  CellSrc(Programs programs, drivers::Duration brake_test);

  /// Selected, BCO done, $EXT_START; behind a message: acknowledged, reset and started again.
  void start();
  /// Stopped and reset by the PLC, whatever it runs.
  void leave();
  void tick(drivers::TimePoint now);
  bool asks() const { return runs_ == Runs::kAsks; }
  /// PGNO with PGNO_VALID. False: it does not ask, or has no such CASE (PGNO_FAULT).
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
