#pragma once
// The RSI adapter's mover by itself, cycle by cycle, with a scripted arm.

#include <gtest/gtest.h>

#include <functional>
#include <vector>

#include "drivers/kuka/rsi/rsi_mover.h"
#include "drivers/units.h"
#include "tests/drivers/kuka/expect_cause.h"
#include "tests/drivers/kuka/rsi/scripted_guard.h"

namespace cellcal::drivers {

class MoverRig {
 public:
  explicit MoverRig(double packet_s = 0.004, bool with_guard = true)
      : cycle_s(packet_s), mover(config, with_guard ? &guard : nullptr, record) {
    config.limits.assign(3, {-9, 9, 100 * kRadPerDeg, 400 * kRadPerDeg, 4000 * kRadPerDeg});
    commanded.assign(3, 0.0);
    for (int i = 0; i < 120; ++i) cycle();  // at rest for a long time
  }

  /// One packet; its result, if the move is over.
  std::optional<CoreResult> cycle(bool heard = true, bool advance = true, bool taken = true) {
    now += std::chrono::duration_cast<Duration>(std::chrono::duration<double>(cycle_s));
    ipoc += static_cast<std::uint32_t>(1000 * cycle_s);
    record.push(now, ipoc, arm(commanded), commanded);
    mover.listen(now);
    const auto result =
        mover.step({now, cycle_s, {0.001, true}, advance, heard, true, taken}, commanded);
    record.set_commanded(commanded);
    return result;
  }
  void run(int cycles) {
    for (int i = 0; i < cycles; ++i) ASSERT_FALSE(cycle()) << "over already";
  }

  std::optional<CoreResult> start(MoveKind kind, double a2_deg, double cruise_s = 0.0,
                                  std::uint16_t arm_id = 0) {
    AxisAngles target = commanded;
    target[1] += a2_deg * kRadPerDeg;
    mover.listen(now);
    return mover.start({++id, kind, target, cruise_s, arm_id}, commanded);
  }

  struct End {
    CoreResult result;
    int cycles = 0;      ///< until the result
    int motionless = 0;  ///< of them after the last change of the command
  };
  /// Until the move is over.
  End end(int limit = 3000) {
    End end;
    while (end.cycles < limit) {
      const AxisAngles before = commanded;
      const auto result = cycle();
      ++end.cycles;
      end.motionless = commanded == before ? end.motionless + 1 : 0;
      if (!result) continue;
      end.result = *result;
      EXPECT_EQ(result->id, id);
      EXPECT_EQ(result->at_rad, commanded);
      EXPECT_EQ(result->ipoc, ipoc);
      EXPECT_FALSE(mover.busy());
      return end;
    }
    ADD_FAILURE() << "no result";
    return end;
  }

  double cycle_s;
  RsiConfig config;
  ScriptedGuard guard;
  PositionRecord record;
  Mover mover;
  TimePoint now{std::chrono::seconds(1000)};
  std::uint32_t ipoc = 0, id = 0;
  AxisAngles commanded;
  std::function<AxisAngles(const AxisAngles&)> arm = [](const AxisAngles& c) { return c; };
};

inline void expect_end(const CoreResult& result, MoveOutcome outcome, const Cause& cause,
                       double within = 1e-9) {
  EXPECT_EQ(result.outcome, outcome) << to_string(result.outcome);
  expect_cause(result.cause, cause, within);
  EXPECT_EQ(result.latch.has_value(), outcome == MoveOutcome::kContact);
}

}  // namespace cellcal::drivers
