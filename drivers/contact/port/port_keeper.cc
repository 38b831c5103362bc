#include "drivers/contact/port/port_keeper.h"

#include <poll.h>

#include <algorithm>
#include <optional>
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

namespace {

using Steady = std::chrono::steady_clock;
using std::chrono::milliseconds;

constexpr milliseconds kPause{1};

/// Rate limit of a reader with higher priority than the robot's thread: ten times the rate of a
/// line of 1 Mbaud, plus the maximum content of a terminal after a stall. A flood delays the port,
/// not the robot.
class Budget {
 public:
  void spend(std::size_t bytes) {
    const TimePoint now = Steady::now();
    const double earned =
        kPerSecond * std::chrono::duration<double>(now - std::exchange(last_, now)).count();
    left_ = std::min(kMost, left_ + earned) - static_cast<double>(bytes);
    if (left_ < 0.0) std::this_thread::sleep_for(kPause);
  }

 private:
  static constexpr double kPerSecond = 1e6, kMost = 64.0 * 1024.0;
  double left_ = kMost;
  TimePoint last_ = Steady::now();
};

/// Pending bytes as news. Empty: none; kind kLost: none from now on.
std::optional<PortUpdate> read_some(Port& port) {
  PortUpdate news;
  const PortReading reading = port.read(news.bytes);
  news.t = Steady::now();
  news.arrived = reading.arrived;
  news.size = static_cast<std::uint16_t>(reading.size);
  news.error = reading.error;
  if (reading.lost) news.kind = PortUpdate::Kind::kLost;
  if (!reading.lost && reading.size == 0) return std::nullopt;
  return news;
}

}  // namespace

PortPump::PortPump(std::unique_ptr<Port> port, const PortPumpOptions& options, PortQueues& queues,
                   std::function<void()> lost)
    : port_(std::move(port)),
      options_(options),
      queues_(queues),
      lost_(std::move(lost)),
      reader_([this] { read_port(); }),
      writer_([this] { write_port(); }) {}

PortPump::~PortPump() {
  stop_ = true;
  stop_reading_.make();
  queues_.frames_call.make();
  reader_.join();
  writer_.join();
}

/// Waits while the robot's thread does not run; the bytes then stay in the terminal.
void PortPump::report(const PortUpdate& news) {
  while (!queues_.news.push(news)) {
    if (stop_) return;
    std::this_thread::sleep_for(kPause);
  }
  queues_.news_call.make();
}

void PortPump::read_port() {
  configure_port_thread("port-read", options_.priority);
  PortUpdate opened;
  opened.kind = PortUpdate::Kind::kOpened;
  opened.opening = options_.opening;
  opened.t = Steady::now();
  report(opened);
  Budget budget;
  while (!stop_) {
    pollfd ends[2] = {{port_->fd(), POLLIN, 0}, {stop_reading_.fd(), POLLIN, 0}};
    if (::poll(ends, 2, -1) < 0 || ends[0].revents == 0) continue;
    std::optional<PortUpdate> news = read_some(*port_);
    if (!news) continue;
    news->opening = options_.opening;
    report(*news);
    if (news->kind == PortUpdate::Kind::kLost) return lost_();
    budget.spend(news->size);
  }
}

void PortPump::write_port() {
  configure_port_thread("port-write", options_.priority);
  while (!stop_) {
    pollfd call{queues_.frames_call.fd(), POLLIN, 0};
    if (::poll(&call, 1, -1) < 0) continue;
    queues_.frames_call.take();
    send_queued();
  }
  send_queued();
}

void PortPump::send_queued() {
  PortFrame frame;
  while (queues_.frames.pop(frame)) {
    if (frame.opening != options_.opening) continue;
    // A frame that does not fit is lost, as on a bad line: the protocol repeats important data, and
    // the sensor's reader resynchronises at the next delimiter. A dead port is detected by read().
    if (!port_->write({frame.bytes.data(), frame.size})) ++queues_.unsent;
  }
}

}  // namespace cellcal::drivers
