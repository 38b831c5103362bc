#pragma once
// SerialContact on a port in real time, for tests of the port's backends.

#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <chrono>
#include <functional>
#include <optional>
#include <thread>

#include "drivers/contact/serial_contact.h"

namespace cellcal::drivers {

/// The whole driver on a port, with the robot's thread.
class RobotSide {
 public:
  explicit RobotSide(const PortOptions& port) : contact_(io_, options_for(port)) {
    thread_ = std::thread([this] { io_.run(); });
    contact_.open();
  }
  ~RobotSide() {
    contact_.close();
    io_.stop();
    thread_.join();
  }
  ContactStatus status() const { return contact_.status(); }
  static bool wait_for(const std::function<bool()>& done) {
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds{20};
    while (!done()) {
      if (std::chrono::steady_clock::now() > end) return false;
      std::this_thread::sleep_for(std::chrono::milliseconds{1});
    }
    return true;
  }
  bool ready() {
    return wait_for([&] { return status().link == ContactLink::kReady; });
  }
  /// For some heartbeats; a failed read would be repeated immediately.
  bool stays_ready() {
    for (int i = 0; i < 100; ++i) {
      if (status().link != ContactLink::kReady) return false;
      std::this_thread::sleep_for(std::chrono::milliseconds{5});
    }
    return true;
  }
  bool arms() {
    std::uint16_t id = 0;
    return wait_for([&] {
      contact_.arm(++id, std::chrono::seconds{30});
      std::optional<ArmResult> result;
      wait_for([&] { return (result = contact_.poll_arm()).has_value(); });
      return result && result->armed;
    });
  }

 private:
  static SerialContactOptions options_for(const PortOptions& port) {
    SerialContactOptions options;
    options.port = port;
    options.contact.max_clock_sigma_s = 0.02;  // tolerates a loaded test machine
    options.reopen_first = std::chrono::milliseconds{20};
    options.reopen_longest = std::chrono::milliseconds{100};
    return options;
  }
  boost::asio::io_context io_;
  boost::asio::executor_work_guard<boost::asio::io_context::executor_type> guard_{
      io_.get_executor()};
  SerialContact contact_;
  std::thread thread_;
};

}  // namespace cellcal::drivers
