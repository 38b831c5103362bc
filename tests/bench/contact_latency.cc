// How long a byte of the sensor takes from the terminal's master end to the event on the io thread.
// Prints figures; gates nothing, because the machine's load is part of them.

#include <fcntl.h>
#include <fmt/format.h>
#include <pthread.h>
#include <pty.h>
#include <sched.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <cstdlib>
#include <cstring>
#include <thread>
#include <vector>

#include "drivers/contact/contact_core.h"
#include "drivers/contact/ctp_codec.h"
#include "drivers/contact/serial_port.h"

namespace {

namespace ctp = cellcal::drivers::ctp;
using cellcal::drivers::ContactCore;
using cellcal::drivers::TimePoint;
using Steady = std::chrono::steady_clock;

constexpr int kDefaultEvents = 2000;
constexpr std::chrono::milliseconds kBetween{2};
constexpr int kPriority = 80;

struct Reader {
  boost::asio::io_context io;
  boost::asio::posix::stream_descriptor stream{io};
  ContactCore core{{}, [](std::span<const std::uint8_t>) {}};
  std::array<std::uint8_t, 4096> bytes{};
  std::atomic<std::int64_t> seen_ns{0};

  void read() {
    stream.async_read_some(boost::asio::buffer(bytes),
                           [this](boost::system::error_code error, std::size_t n) {
                             if (error) return;
                             core.on_bytes({bytes.data(), n}, Steady::now());
                             if (core.take_event()) {
                               seen_ns = Steady::now().time_since_epoch().count();
                             }
                             read();
                           });
  }
};

}  // namespace

int main(int argc, char** argv) {
  const int events = argc > 1 ? std::atoi(argv[1]) : kDefaultEvents;
  int master = -1, slave = -1;
  std::array<char, 256> name{};
  if (::openpty(&master, &slave, nullptr, nullptr, nullptr) != 0 ||
      ::ttyname_r(slave, name.data(), name.size()) != 0) {
    fmt::print(stderr, "no pseudo-terminal: {}\n", std::strerror(errno));
    return 1;
  }
  Reader reader;
  const auto port = cellcal::drivers::open_serial_port({name.data(), CTP_DEFAULT_BAUD});
  ::close(slave);
  reader.stream.assign(::dup(port->fd()));
  reader.core.connect(Steady::now());
  reader.read();
  std::thread thread([&reader] { reader.io.run(); });
  sched_param priority{};
  priority.sched_priority = kPriority;
  const bool realtime = ::pthread_setschedparam(thread.native_handle(), SCHED_FIFO, &priority) == 0;

  std::vector<double> us;
  for (int i = 0; i < events; ++i) {
    const auto trip = ctp::build(ctp::Trip{1, 0}, static_cast<std::uint8_t>(i));
    std::this_thread::sleep_for(kBetween);
    reader.seen_ns = 0;
    const auto sent = Steady::now();
    if (::write(master, trip.data.data(), trip.size) != static_cast<ssize_t>(trip.size)) return 1;
    std::int64_t seen = 0;
    while ((seen = reader.seen_ns) == 0 && Steady::now() - sent < std::chrono::seconds{1}) {
      std::this_thread::sleep_for(std::chrono::microseconds{200});
    }
    if (seen == 0) {
      fmt::print(stderr, "event {} was not seen within 1 s\n", i);
      return 1;
    }
    us.push_back(static_cast<double>(seen - sent.time_since_epoch().count()) * 1e-3);
  }
  reader.io.stop();
  thread.join();
  ::close(master);
  std::sort(us.begin(), us.end());
  const auto at = [&us](double q) {
    return us[static_cast<std::size_t>(q * static_cast<double>(us.size() - 1))];
  };
  fmt::print(
      "pty byte in to event on the io thread ({}), {} events: p50 {:.0f} p99 {:.0f} max {:.0f} "
      "us\n",
      realtime ? "SCHED_FIFO" : "normal priority", us.size(), at(0.5), at(0.99), us.back());
  return 0;
}
