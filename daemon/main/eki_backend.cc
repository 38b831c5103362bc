#include <spdlog/spdlog.h>

#include <chrono>

#include "daemon/main/backends.h"
#include "drivers/contact/serial_contact.h"
#include "drivers/io_thread.h"
#include "drivers/kuka/eki_robot.h"

namespace cellcal::daemon {

namespace {

/// EkiRobot::close() waits for rest and says goodbye for at most 3 s, so that the controller does
/// not have to find out by itself.
constexpr std::chrono::milliseconds kLongestFarewell{3500};

class EkiBackend final : public Backend {
 public:
  EkiBackend(const DaemonConfig& config, const calib::Cell& cell)
      : io_(drivers::IoThreadOptions{.realtime = config.realtime}),
        contact_(io_.context(), contact_options(config)),
        robot_(io_.context(), eki_config_for(config, cell), &contact_.guard()) {
    io_.start();
  }

  ~EkiBackend() override {
    robot_.close();
    contact_.close();
    drivers::Clock& steady = clock();
    const drivers::TimePoint end = steady.now() + kLongestFarewell;
    while (robot_.is_open() && steady.now() < end) {
      steady.sleep_until(steady.now() + std::chrono::milliseconds(5));
    }
    if (robot_.is_open()) spdlog::warn("the controller's EKI connection did not close in time");
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
  drivers::EkiRobot robot_;
};

}  // namespace

std::unique_ptr<Backend> make_eki_backend(const DaemonConfig& config, const calib::Cell& cell) {
  return std::make_unique<EkiBackend>(config, cell);
}

}  // namespace cellcal::daemon
