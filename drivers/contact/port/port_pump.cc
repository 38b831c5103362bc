#include "drivers/contact/port/port_pump.h"

#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <optional>
#include <utility>

#include "drivers/contact/port/port_thread.h"

namespace cellcal::drivers {

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
std::optional<PortNews> read_some(Port& port) {
  PortNews news;
  const PortReading reading = port.read(news.bytes);
  news.t = Steady::now();
  news.arrived = reading.arrived;
  news.size = static_cast<std::uint16_t>(reading.size);
  news.error = reading.error;
  if (reading.lost) news.kind = PortNews::Kind::kLost;
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
void PortPump::tell(const PortNews& news) {
  while (!queues_.news.push(news)) {
    if (stop_) return;
    std::this_thread::sleep_for(kPause);
  }
  queues_.news_call.make();
}

void PortPump::read_port() {
  become_port_thread("port-read", options_.priority);
  PortNews opened;
  opened.kind = PortNews::Kind::kOpened;
  opened.opening = options_.opening;
  opened.t = Steady::now();
  tell(opened);
  Budget budget;
  while (!stop_) {
    pollfd ends[2] = {{port_->fd(), POLLIN, 0}, {stop_reading_.fd(), POLLIN, 0}};
    if (::poll(ends, 2, -1) < 0 || ends[0].revents == 0) continue;
    std::optional<PortNews> news = read_some(*port_);
    if (!news) continue;
    news->opening = options_.opening;
    tell(*news);
    if (news->kind == PortNews::Kind::kLost) return lost_();
    budget.spend(news->size);
  }
}

void PortPump::write_port() {
  become_port_thread("port-write", options_.priority);
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
