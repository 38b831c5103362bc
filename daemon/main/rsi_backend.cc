#include <spdlog/spdlog.h>

#include <chrono>

#include "daemon/main/backends.h"
#include "drivers/contact/serial_contact.h"
#include "drivers/io_thread.h"
#include "drivers/kuka/rsi_robot.h"

namespace cellcal::daemon {

namespace {

/// RsiRobot::close() goes on answering the controller for at most 2 s, so that it ends its session
/// instead of faulting.
constexpr std::chrono::milliseconds kLongestFarewell{2500};

class RsiBackend final : public Backend {
 public:
  RsiBackend(const DaemonConfig& config, const calib::Cell& cell)
      : io_(drivers::IoThreadOptions{.realtime = config.realtime}),
        contact_(io_.context(), contact_options(config)),
        robot_(io_.context(), rsi_config_for(config, cell), &contact_.guard()) {
    io_.start();
  }

  ~RsiBackend() override {
    robot_.close();
    contact_.close();
    drivers::Clock& steady = clock();
    const drivers::TimePoint end = steady.now() + kLongestFarewell;
    while (robot_.port() != 0 && steady.now() < end) {
      steady.sleep_until(steady.now() + std::chrono::milliseconds(5));
    }
    if (robot_.port() != 0) spdlog::warn("the controller's RSI session did not end in time");
    if (robot_.foreign_packets() > 0) {
      spdlog::warn("{} RSI packets from foreign addresses were ignored", robot_.foreign_packets());
    }
  }

  drivers::Robot& robot() override { return robot_; }
  drivers::ContactSensor& contact() override { return contact_; }
  drivers::Clock& clock() override { return drivers::steady_clock(); }
  std::string utc_now() override { return wall_clock_utc(); }

 private:
  static drivers::SerialContactOptions contact_options(const DaemonConfig& config) {
    drivers::SerialContactOptions options;
    options.port = config.contact;
    return options;
  }

  // In this order: what lives on the context goes before it.
  drivers::IoThread io_;
  drivers::SerialContact contact_;
  drivers::RsiRobot robot_;
};

}  // namespace

std::unique_ptr<Backend> make_rsi_backend(const DaemonConfig& config, const calib::Cell& cell) {
  return std::make_unique<RsiBackend>(config, cell);
}

}  // namespace cellcal::daemon
