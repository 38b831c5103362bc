#include "drivers/contact/port_keeper.h"

#include <algorithm>
#include <utility>

namespace cellcal::drivers {

PortKeeper::PortKeeper(SerialPortOptions options, std::chrono::milliseconds first,
                       std::chrono::milliseconds longest, Opened opened)
    : options_(std::move(options)),
      first_(first),
      longest_(longest),
      opened_(std::move(opened)),
      thread_([this] { run(); }) {}

PortKeeper::~PortKeeper() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

void PortKeeper::dispose(std::unique_ptr<SerialPort> port) {
  {
    const std::lock_guard lock(mutex_);
    to_close_.push_back(std::move(port));
  }
  changed_.notify_all();
}

void PortKeeper::reopen(std::unique_ptr<SerialPort> port) {
  {
    const std::lock_guard lock(mutex_);
    to_close_.push_back(std::move(port));
    wanted_ = true;
    last_error_.clear();
  }
  changed_.notify_all();
}

void PortKeeper::give_up() {
  std::unique_lock lock(mutex_);
  wanted_ = false;
  changed_.notify_all();
  changed_.wait(lock, [this] { return !busy_ && to_close_.empty(); });
}

std::string PortKeeper::last_error() const {
  const std::lock_guard lock(mutex_);
  return last_error_;
}

void PortKeeper::run() {
  std::unique_lock lock(mutex_);
  auto pause = first_;
  while (true) {
    changed_.wait(lock, [this] { return stop_ || wanted_ || !to_close_.empty(); });
    if (!to_close_.empty()) {
      auto closing = std::exchange(to_close_, {});
      busy_ = true;
      lock.unlock();
      closing.clear();
      lock.lock();
      busy_ = false;
      changed_.notify_all();
      pause = first_;
      continue;
    }
    if (stop_) return;
    // A device that has just gone is not back at once, and may come back half.
    const bool disturbed =
        changed_.wait_for(lock, pause, [this] { return stop_ || !wanted_ || !to_close_.empty(); });
    if (disturbed) continue;
    busy_ = true;
    lock.unlock();
    std::unique_ptr<SerialPort> port;
    std::string error;
    try {
      port = open_serial_port(options_);
    } catch (const std::runtime_error& e) {  // goes to the operator through last_error()
      error = e.what();
    }
    const bool opened = port != nullptr;
    if (opened) opened_(std::move(port));
    lock.lock();
    busy_ = false;
    last_error_ = error;
    if (opened) {
      wanted_ = false;
      pause = first_;
    } else {
      pause = std::min(pause * 2, longest_);
    }
    changed_.notify_all();
  }
}

}  // namespace cellcal::drivers
