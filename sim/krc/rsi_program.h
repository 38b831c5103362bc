#pragma once
// The program around RSI (CELLCAL_RSI of drivers/kuka/krl), executed on the emulated controller.

#include <optional>
#include <string>
#include <vector>

#include "sim/krl/interpreter.h"

namespace cellcal::sim {

/// Settings of the program at RSI_MOVECORR.
struct RsiStart {
  std::vector<double> low_deg, high_deg;  ///< AXISCORR's limits of A1 to A6, then AXISCORREXT's
  std::optional<bool> relative;           ///< RSI_ON's argument
};

class RsiProgram final : krl::Mover {
 public:
  /// Text of a .src; empty: one that sets nothing. Throws calib::FileError.
  explicit RsiProgram(const std::string& text);

  /// From its beginning to RSI_MOVECORR. Angles as in KRL: actual, and the software limit switches. False: message().
  bool start(const std::vector<double>& actual_deg, const std::vector<double>& soft_min_deg,
             const std::vector<double>& soft_max_deg, RsiStart& start);
  /// RSI_MOVECORR has ended: to the end.
  void finish();
  /// File and line where it halted or failed.
  const std::string& message() const { return robot_.message(); }

 private:
  // Only corrections move the arm: the target of PTP is the current position.
  void move(const krl::Motion&) override {}
  bool moving() const override { return false; }
  void brake(bool) override {}
  void drop_motion() override {}
  void go_on() override {}

  void set_limit(const std::string& parameter, double value);

  krl::Program program_;
  krl::Interpreter robot_;
  RsiStart* start_ = nullptr;
};

}  // namespace cellcal::sim
