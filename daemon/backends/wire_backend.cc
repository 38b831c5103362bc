#include <spdlog/spdlog.h>

#include <boost/asio/io_context.hpp>
#include <chrono>
#include <cstdint>
#include <utility>

#include "calib/model/units.h"
#include "daemon/backends/backends.h"
#include "daemon/config/config.h"
#include "drivers/contact/serial_contact.h"
#include "drivers/io_thread.h"
#include "drivers/kuka/eki/eki_robot.h"
#include "drivers/kuka/rsi/rsi_robot.h"

namespace cellcal::daemon {

namespace {

/// close() of both robots keeps talking to the controller until it ends its session: at most 2 s over RSI, 3
/// s over EKI.
constexpr std::chrono::milliseconds kFarewellTimeout{3500};

drivers::SerialContactOptions contact_options(const DaemonConfig& config) {
  drivers::SerialContactOptions options;
  options.port = config.contact;
  options.contact.relay = config.isolation == Isolation::kRelay;
  if (!config.realtime) options.port.priority = 0;
  return options;
}

/// Final statistics of a link.
void log_end(const drivers::RsiRobot& robot) {
  if (robot.foreign_packets() > 0) {
    spdlog::warn(
        "{} RSI packets from other addresses ignored: check whether two controllers send to "
        "one port",
        robot.foreign_packets());
  }
  const drivers::ReplyHistogram& times = robot.reply_times();
  if (times.count() > 0) {
    spdlog::info("{} RSI replies: p50 {:.3f} ms, p99.9 {:.3f} ms after the packet", times.count(),
                 calib::kMsPerS * times.quantile_s(0.5), calib::kMsPerS * times.quantile_s(0.999));
  }
}
void log_end(const drivers::EkiRobot&) {}

/// KUKA controller over one of its wires, and contact sensor on a serial port.
template <typename Robot>
class WireBackend final : public Backend {
 public:
  template <typename RobotConfig>
  WireBackend(const DaemonConfig& config, const calib::Cell& cell, RobotConfig robot,
              calib::Passable passable = {}, std::optional<double> axis_reach_rad = {})
      : wire_(wire_of(config)),
        frames_(daemon::stated_frames(config, cell)),
        passable_(std::move(passable)),
        axis_reach_rad_(axis_reach_rad),
        io_(drivers::IoThreadOptions{.realtime = config.realtime}),
        contact_(io_.context(), contact_options(config)),
        robot_(io_.context(), std::move(robot), &contact_.guard()) {
    io_.start();
  }

  ~WireBackend() override {
    robot_.close();
    contact_.close();
    drivers::Clock& steady = clock();
    const drivers::TimePoint end = steady.now() + kFarewellTimeout;
    while (robot_.is_open() && steady.now() < end) {
      steady.sleep_until(steady.now() + std::chrono::milliseconds(5));
    }
    if (robot_.is_open()) spdlog::warn("the session with the controller did not end in time");
    log_end(robot_);
  }

  drivers::Robot& robot() override { return robot_; }
  drivers::ContactSensor& contact() override { return contact_; }
  drivers::Clock& clock() override { return drivers::steady_clock(); }
  std::string utc_now() override { return wall_clock_utc(); }
  calib::Phrase how_to_start() const override { return start_instruction(wire_); }
  calib::Passable passable() override { return passable_; }
  std::optional<double> axis_reach_rad() override { return axis_reach_rad_; }
  calib::StatedFrames stated_frames() override { return frames_; }
  /// True if the devices' thread has run handlers since the last call.
  bool devices_alive() override {
    const std::uint64_t now = io_.beats();
    return std::exchange(beats_seen_, now) != now;
  }

 private:
  WireKind wire_;
  calib::StatedFrames frames_;
  calib::Passable passable_;
  std::optional<double> axis_reach_rad_;
  std::uint64_t beats_seen_ = ~std::uint64_t{0};
  // Declaration order: objects on the context are destroyed before it.
  drivers::IoThread io_;
  drivers::SerialContact contact_;
  Robot robot_;
};

}  // namespace

std::unique_ptr<Backend> make_rsi_backend(const DaemonConfig& config, const calib::Cell& cell) {
  drivers::RsiConfig rsi = rsi_config_for(config, cell);
  calib::Passable passable = passable_in_space(rsi.space);
  return std::make_unique<WireBackend<drivers::RsiRobot>>(
      config, cell, std::move(rsi), std::move(passable), correction_limit_rad(config));
}

std::unique_ptr<Backend> make_eki_backend(const DaemonConfig& config, const calib::Cell& cell) {
  return std::make_unique<WireBackend<drivers::EkiRobot>>(config, cell,
                                                          eki_config_for(config, cell));
}

}  // namespace cellcal::daemon
