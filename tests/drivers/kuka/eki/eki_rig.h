#pragma once
// The EKI adapter's core with the emulated controller in virtual time, a scripted contact sensor,
// and a wall in the path of A1.

#include <gtest/gtest.h>

#include <functional>
#include <map>
#include <numbers>
#include <string>

#include "drivers/kuka/eki/eki_core.h"
#include "drivers/kuka/krl/krl_files.h"
#include "sim/krc/eki_controller.h"
#include "tests/drivers/kuka/rsi/virtual_rig.h"
#include "tests/drivers/said.h"

namespace cellcal::drivers {

inline constexpr double kEkiDeg = std::numbers::pi / 180.0;

inline EkiConfig eki_config() {
  EkiConfig config;
  config.limits.assign(6, {-185 * kEkiDeg, 185 * kEkiDeg, 100 * kEkiDeg, 0, 0});
  config.limits[1] = {-180 * kEkiDeg, 65 * kEkiDeg, 100 * kEkiDeg, 0, 0};
  config.full_speed_rad_s.assign(6, 200 * kEkiDeg);
  return config;
}

inline sim::EkiControllerConfig eki_controller() {
  sim::EkiControllerConfig config;
  config.files = eki_files({});
  config.max_speed_rad_s.assign(6, 200 * kEkiDeg);
  config.input_delay_s = config.input_sample_s = 0.0;
  return config;
}

// Over real sockets, on a machine that may be loaded.

inline EkiConfig eki_loopback(std::uint16_t port) {
  EkiConfig config = eki_config();
  config.address = "127.0.0.1";
  config.port = port;
  config.silence_s = 2.0;
  return config;
}

inline sim::EkiControllerConfig patient_eki_controller() {
  sim::EkiControllerConfig config = eki_controller();
  EkiFilesConfig files;
  files.dead_man_ms = 1000;
  config.files = eki_files(files);
  return config;
}

class EkiRig : public VirtualRig<EkiRig> {
 public:
  explicit EkiRig(sim::EkiControllerConfig controller = eki_controller(),
                  EkiConfig config = eki_config(), bool with_guard = true)
      : krc(std::move(controller)), core(std::move(config), with_guard ? &guard : nullptr) {
    krc.start_program();
  }

  ~EkiRig() { EXPECT_EQ(krc.fault(), ""); }

  /// One interpolation cycle: the controller ticks, bytes travel both ways, the adapter ticks.
  void cycle() {
    now += krc.cycle();
    krc.tick(now);
    if (wall_rad) run_into_wall();
    if (connected && !krc.connected()) close_connection();  // the controller has closed it
    if (connected && cable) core.on_bytes(mangle(krc.drain_output()), now + 300us);
    if (before_tick) before_tick();
    core.on_tick(now + 300us);
    if (connected && core.wants_close()) close_connection();
    if (connected && cable) {
      const std::string bytes = mangle_written(std::string(core.output()));
      core.sent(core.output().size());
      written += bytes;
      krc.receive(bytes);
    }
  }
  bool connect() {
    if (!krc.connect()) return false;
    connected = true;
    core.on_connected(++session, now);
    return true;
  }
  void close_connection() {
    connected = false;
    krc.disconnect();
    core.on_closed(now);
  }
  void make_ready() {
    run(40ms);
    ASSERT_TRUE(connect());
    ASSERT_TRUE(run_until([&] { return link() == RobotLink::kNotReferenced; }, 2s)) << words();
    reference();
  }
  void reference() {
    core.rereference();
    ASSERT_TRUE(run_until([&] { return link() == RobotLink::kReady; }, 3s)) << words();
  }

  RobotLink link() const { return core.state().link; }
  std::string words() const { return said(core.state().words); }
  AxisAngles actual() const { return core.state().actual_rad; }
  AxisAngles moved_by(std::size_t axis, double deg) const {
    AxisAngles target = actual();
    target[axis] += deg * kEkiDeg;
    return target;
  }
  double true_deg(std::size_t axis = 0) const { return krc.actual_rad_at(now)[axis] / kEkiDeg; }

  /// An armed search along A1 by `deg` in `cruise_s`.
  CoreResult search(double deg, double cruise_s) {
    guard.arm(++arm_id);
    return move(MoveKind::kSearch, moved_by(0, deg), cruise_s, arm_id);
  }

  sim::EkiController krc;
  EkiCore core;
  std::string written;  ///< all output of the adapter
  bool cable = true, connected = false;
  std::function<std::string(std::string)> mangle = [](std::string bytes) { return bytes; };
  std::function<std::string(std::string)> mangle_written = mangle;
  std::function<void()> before_tick;
  std::uint32_t session = 100;
  std::uint16_t arm_id = 0;

  // The wall, its visibility to each stop path, and the sensor's reaction.
  std::optional<double> wall_rad;
  bool wired_to_input = true, seen_by_sensor = true, revokes = false;
  TimePoint touched_at{};  ///< the instant of the last contact
  double touched_deg = 0.0;

 private:
  bool beyond(TimePoint t) const { return krc.actual_rad_at(t)[0] >= *wall_rad; }

  void run_into_wall() {
    const TimePoint next = now + krc.cycle();
    if (beyond(next) != touching_) {
      TimePoint before = now, after = next;
      while (after - before > 1us) {
        const TimePoint middle = before + (after - before) / 2;
        (beyond(middle) == touching_ ? before : after) = middle;
      }
      touching_ = !touching_;
      if (wired_to_input) krc.input(after, touching_);
      if (touching_) {
        touched_at = after;
        touched_deg = krc.actual_rad_at(after)[0] / kEkiDeg;
      }
      if (seen_by_sensor) notify_sensor(after);
    }
    for (auto it = sensor_.begin(); it != sensor_.end() && it->first <= now;) {
      it->second();
      it = sensor_.erase(it);
    }
  }

  void notify_sensor(TimePoint edge) {
    if (!touching_) {
      sensor_.emplace(edge, [this] { guard.touch(false); });
      return;
    }
    const bool armed = guard.snapshot(now).armed;
    const std::uint16_t id = armed ? arm_id : std::uint16_t{0};
    if (armed) sensor_.emplace(edge + 400us, [this, id, edge] { guard.trip(id, edge); });
    sensor_.emplace(edge + 3ms, [this, id, edge, armed] {
      if (!revokes) guard.touch(true);
      if (armed) {
        guard.push(revokes ? ContactEventKind::kRevoked : ContactEventKind::kContact, id, edge);
      }
    });
  }

  bool touching_ = false;
  std::multimap<TimePoint, std::function<void()>> sensor_;
};

}  // namespace cellcal::drivers
