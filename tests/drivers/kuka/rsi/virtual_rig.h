#pragma once
// Common base of both adapters' rigs: virtual time cycle by cycle, moves one at a time.

#include <gtest/gtest.h>

#include <functional>
#include <numbers>
#include <optional>
#include <string>
#include <type_traits>

#include "drivers/error.h"
#include "drivers/robot.h"
#include "tests/drivers/kuka/expect_cause.h"
#include "tests/drivers/kuka/rsi/scripted_guard.h"

namespace cellcal::drivers {

using namespace std::chrono_literals;

/// The error of this configuration once spoilt; empty: accepted.
template <class Config>
std::string complaint_of(Config config,
                         const std::type_identity_t<std::function<void(Config&)>>& spoil) {
  spoil(config);
  try {
    config.validate();
  } catch (const ConfigError& error) {
    return error.what();
  }
  return {};
}

/// `Rig` has cycle(), which advances `now`, and `core`.
template <class Rig>
class VirtualRig {
 public:
  void run(Duration duration) {
    for (const TimePoint end = now + duration; now < end;) rig().cycle();
  }
  bool run_until(const std::function<bool()>& done, Duration limit = 30s) {
    for (const TimePoint end = now + limit; now < end;) {
      rig().cycle();
      if (done()) return true;
    }
    return false;
  }

  void begin(MoveKind kind, const AxisAngles& target, double cruise_s = 0.0,
             std::uint16_t armed_as = 0) {
    rig().core.begin({++last_id, kind, target, cruise_s, armed_as});
  }
  /// Runs until the move has ended.
  CoreResult finish(Duration limit = 30s) {
    std::optional<CoreResult> result;
    EXPECT_TRUE(run_until([&] { return (result = rig().core.next_result()).has_value(); }, limit))
        << "no result";
    if (!result) return {};
    EXPECT_EQ(result->id, last_id);
    return *result;
  }
  CoreResult move(MoveKind kind, const AxisAngles& target, double cruise_s = 0.0,
                  std::uint16_t armed_as = 0) {
    begin(kind, target, cruise_s, armed_as);
    return finish();
  }

  TimePoint now{1000s};
  ScriptedGuard guard;
  std::uint32_t last_id = 0;

 private:
  Rig& rig() { return static_cast<Rig&>(*this); }
};

}  // namespace cellcal::drivers
