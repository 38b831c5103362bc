#pragma once
// The EKI adapter's mover with a scripted controller.

#include <gtest/gtest.h>

#include <chrono>
#include <cstdint>
#include <numbers>
#include <optional>

#include "drivers/kuka/eki/eki_mover.h"
#include "tests/drivers/kuka/expect_cause.h"
#include "tests/drivers/kuka/rsi/scripted_guard.h"

namespace cellcal::drivers {

inline constexpr double kDeg = std::numbers::pi / 180.0;

struct EkiMoverAlone : testing::Test {
  explicit EkiMoverAlone(bool with_sensor = true)
      : mover(config, with_sensor ? &guard : nullptr, record) {
    config.limits.assign(2, {-9, 9, 100 * kDeg, 0, 0});
    config.full_speed_rad_s = {200 * kDeg, 400 * kDeg};
    at_deg = {10.0, -20.0};
    for (int i = 0; i < 20; ++i) state();
  }

  AxisAngles at_rad() const { return {at_deg[0] * kDeg, at_deg[1] * kDeg}; }
  /// A move of A2 by this.
  std::optional<CoreResult> begin(MoveKind kind, double by_deg, double cruise_s = 0.0,
                                  std::uint16_t arm_id = 0) {
    target_deg = {at_deg[0], at_deg[1] + by_deg};
    mover.listen(now);
    auto refused =
        mover.start({++id, kind, {target_deg[0] * kDeg, target_deg[1] * kDeg}, cruise_s, arm_id},
                    at_rad(), now);
    if (!refused) mover.sent(++command);
    return refused;
  }
  void search() {
    guard.disarm();  // the preceding arming has ended, and its number may be reused
    mover.listen(now);
    guard.arm(5);
    ASSERT_FALSE(begin(MoveKind::kSearch, 5.0, 10.0, 5));
    moving();
  }
  std::optional<CoreResult> tick(Duration d = std::chrono::milliseconds(4)) {
    now += d;
    mover.listen(now);
    return mover.on_tick(now);
  }
  /// 20 ms later: a state of the controller.
  std::optional<CoreResult> state(EkiProgress progress = EkiProgress::kIdle,
                                  EkiOutcome outcome = EkiOutcome::kNone) {
    for (int i = 0; i < 5; ++i) {
      if (auto result = tick()) return result;
    }
    time_ms += 20;
    record.push(now, time_ms, at_rad(), at_rad());
    frame.axes_deg = at_deg;
    frame.move_id = command;
    frame.progress = progress;
    frame.outcome = outcome;
    return mover.on_state(frame, now);
  }
  void moving(int count = 1, double each_deg = 0.01) {
    for (int i = 0; i < count; ++i) {
      at_deg[1] += each_deg;
      ASSERT_FALSE(state(EkiProgress::kMoving));
    }
  }
  /// Repeats 'done' until the mover has finished.
  CoreResult done(EkiOutcome outcome, int limit = 300) {
    for (states = 1; states <= limit; ++states) {
      if (const auto result = state(EkiProgress::kDone, outcome)) {
        EXPECT_EQ(result->id, id);
        EXPECT_FALSE(mover.busy());
        return *result;
      }
    }
    ADD_FAILURE() << "no result";
    return {};
  }
  void arrive() { at_deg = target_deg; }

  void expect(const CoreResult& result, MoveOutcome outcome, const Cause& cause,
              double within = 1e-6) {
    EXPECT_EQ(result.outcome, outcome) << to_string(result.outcome);
    expect_cause(result.cause, cause, within);
    EXPECT_EQ(result.latch.has_value(), outcome == MoveOutcome::kContact);
  }

  EkiConfig config;
  ScriptedGuard guard;
  PositionRecord record;
  EkiMover mover;
  TimePoint now{std::chrono::seconds(1000)};
  AxisAngles at_deg, target_deg;
  EkiState frame;
  std::uint32_t id = 0, command = 0, time_ms = 0;
  int states = 0;
};

}  // namespace cellcal::drivers
