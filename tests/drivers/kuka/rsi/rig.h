#pragma once
// The adapter's core with the emulated controller in virtual time, and a scripted contact sensor.

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <string>

#include "drivers/kuka/rsi/rsi_core.h"
#include "sim/krc/controller.h"
#include "tests/drivers/kuka/rsi/virtual_rig.h"

namespace cellcal::drivers {

inline constexpr double kDeg = std::numbers::pi / 180.0;
/// The arming number of searches.
inline constexpr std::uint16_t kArm = 7;

inline bool has(const std::string& text, const std::string& words) {
  return text.find(words) != std::string::npos;
}

/// KR 5 arc's limits, approximately; jerk such that ramps last about 0.1 s.
inline RsiConfig rig_config() {
  RsiConfig config;
  config.limits.assign(6, {-185 * kDeg, 185 * kDeg, 100 * kDeg, 400 * kDeg, 4000 * kDeg});
  config.limits[1] = {-180 * kDeg, 65 * kDeg, 100 * kDeg, 400 * kDeg, 4000 * kDeg};
  config.correction_limit_deg.assign(6, 90.0);
  return config;
}

class Rig : public VirtualRig<Rig> {
 public:
  explicit Rig(sim::ControllerConfig krc_config = {}, RsiConfig config = rig_config(),
               bool with_guard = true)
      : krc(std::move(krc_config)), core(std::move(config), with_guard ? &guard : nullptr) {}

  /// One cycle: the controller ticks, the packet travels, the reply comes back.
  void cycle() {
    now += krc.cycle();
    packet = std::string(krc.tick(now));
    reply.clear();
    if (before_core) before_core();
    if (!packet.empty() && to_pc) {
      const TimePoint t_rx = now + network_delay();
      core.on_tick(t_rx);
      reply = std::string(core.on_datagram(packet, t_rx));
    } else {
      core.on_tick(now);
    }
    if (!reply.empty() && to_krc) krc.receive(to_krc_as(reply));
    if (after_cycle) after_cycle();
  }

  /// RSI_ON, first packets, reference.
  void make_ready() {
    krc.rsi_on();
    run(200ms);
    make_referenced();
  }

  /// A reference in the current session.
  void make_referenced() {
    core.rereference();
    ASSERT_TRUE(run_until([&] { return core.state().link == RobotLink::kReady; }, 2s))
        << core.state().words;
  }

  AxisAngles commanded() const { return core.state().commanded_rad; }
  AxisAngles moved_by(std::size_t axis, double deg) const {
    AxisAngles target = commanded();
    target[axis] += deg * kDeg;
    return target;
  }

  sim::Controller krc;
  RsiCore core;
  std::string packet, reply;
  bool to_pc = true, to_krc = true;
  std::function<void()> before_core, after_cycle;
  /// Modification of a reply on its way to the controller.
  std::function<std::string(const std::string&)> to_krc_as = [](const std::string& r) { return r; };
  std::function<Duration()> network_delay = [] { return Duration(100us); };
};

}  // namespace cellcal::drivers
