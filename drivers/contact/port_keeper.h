#pragma once
// A thread that closes lost ports and opens them again with back-off. Opening and closing a device
// can take longer than the robot's cycle lasts, so neither happens on the robot's thread.

#include <chrono>
#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "drivers/contact/serial_port.h"

namespace cellcal::drivers {

class PortKeeper {
 public:
  /// Takes a port that was opened again; called on the keeper's thread.
  using Opened = std::function<void(std::unique_ptr<SerialPort>)>;

  PortKeeper(SerialPortOptions options, std::chrono::milliseconds first,
             std::chrono::milliseconds longest, Opened opened);
  ~PortKeeper();
  PortKeeper(const PortKeeper&) = delete;
  PortKeeper& operator=(const PortKeeper&) = delete;

  /// Closes the port on the keeper's thread.
  void dispose(std::unique_ptr<SerialPort> port);
  /// Closes the port and opens it again as soon as that is possible.
  void reopen(std::unique_ptr<SerialPort> port);
  /// No further attempts; returns when none is under way.
  void give_up();
  /// Why the last attempt failed; empty when there was none since reopen().
  std::string last_error() const;

 private:
  void run();

  const SerialPortOptions options_;
  const std::chrono::milliseconds first_, longest_;
  const Opened opened_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<std::unique_ptr<SerialPort>> to_close_;
  std::string last_error_;
  bool stop_ = false, wanted_ = false, busy_ = false;
  std::thread thread_;
};

}  // namespace cellcal::drivers
