#include "drivers/contact/port/port_keeper.h"

#include <algorithm>
#include <utility>

namespace cellcal::drivers {

PortKeeper::PortKeeper(PortKeeperOptions options, PortQueues& queues)
    : options_(std::move(options)), queues_(queues), thread_([this] { run(); }) {}

PortKeeper::~PortKeeper() {
  close();
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

std::uint32_t PortKeeper::next_opening() const {
  const std::lock_guard lock(mutex_);
  return openings_ + 1;
}

std::string PortKeeper::last_error() const {
  const std::lock_guard lock(mutex_);
  return last_error_;
}

std::string PortKeeper::warning() const {
  const std::lock_guard lock(mutex_);
  return warning_;
}

/// Without holding the mutex, since it may take long.
std::unique_ptr<PortPump> PortKeeper::open_now() {
  std::unique_ptr<Port> port = open_port(options_.port);
  PortPumpOptions options{0, options_.port.priority};
  {
    const std::lock_guard lock(mutex_);
    options.opening = ++openings_;
    warning_ = port->warning();
    lost_ = false;
  }
  return std::make_unique<PortPump>(std::move(port), options, queues_, [this] {
    {
      const std::lock_guard lock(mutex_);
      lost_ = true;
      last_error_.clear();
    }
    changed_.notify_all();
  });
}

void PortKeeper::open() {
  std::unique_ptr<PortPump> pump = open_now();
  {
    const std::lock_guard lock(mutex_);
    pump_ = std::move(pump);
    wanted_ = true;
    last_error_.clear();
  }
  changed_.notify_all();
}

void PortKeeper::close() {
  std::unique_ptr<PortPump> closing;
  {
    std::unique_lock lock(mutex_);
    wanted_ = false;
    changed_.notify_all();
    changed_.wait(lock, [this] { return !busy_; });
    closing = std::move(pump_);
  }
  // Without holding the mutex: its destructor waits for a thread that may be reporting the loss of
  // the port.
  closing.reset();
}

void PortKeeper::run() {
  std::unique_lock lock(mutex_);
  while (true) {
    changed_.wait(lock, [this] { return stop_ || (wanted_ && lost_); });
    if (stop_) return;
    busy_ = true;
    std::unique_ptr<PortPump> closing = std::move(pump_);
    lock.unlock();
    closing.reset();
    lock.lock();
    // A device that disconnected needs time to reappear, and may reappear incompletely.
    for (auto pause = options_.first;
         !changed_.wait_for(lock, pause, [this] { return stop_ || !wanted_; });
         pause = std::min(pause * 2, options_.longest)) {
      lock.unlock();
      std::unique_ptr<PortPump> pump;
      std::string error;
      try {
        pump = open_now();
      } catch (const std::runtime_error& e) {  // reported to the operator by last_error()
        error = e.what();
      }
      lock.lock();
      last_error_ = error;
      pump_ = std::move(pump);
      if (pump_) break;
    }
    busy_ = false;
    changed_.notify_all();
  }
}

}  // namespace cellcal::drivers
