// Latency of a sensor byte from the terminal's master end to the event on the I/O thread. Prints
// figures; no threshold, because the machine's load is part of them.

#include <fmt/format.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <boost/asio/io_context.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <thread>

#include "drivers/contact/contact_core.h"
#include "drivers/contact/port/port.h"
#include "drivers/contact/wire/ctp_codec.h"
#include "tests/bench/loopback.h"
#include "tests/bench/times.h"
#include "tests/command_line/command_line.h"

namespace {

namespace ctp = cellcal::drivers::ctp;
using cellcal::drivers::ContactCore;
using cellcal::drivers::TimePoint;
using Steady = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kBetween{2};

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
                             if (core.pop_event()) {
                               seen_ns = Steady::now().time_since_epoch().count();
                             }
                             read();
                           });
  }
};

}  // namespace

int main(int argc, char** argv) {
  cellcal::CommandLine app{"Bytes of the sensor into the terminal to the event on the io thread."};
  int events = 2000;
  bool normal = false;
  app.option("--events", events, "Trips").between(1, 1'000'000);
  app.option("--normal-priority", normal, "Do not ask for real time");
  if (const auto code = app.parse(argc, argv)) return *code;

  cellcal::bench::Terminal terminal;
  Reader reader;
  const auto port = cellcal::drivers::open_port({terminal.path(), CTP_DEFAULT_BAUD});
  reader.stream.assign(::dup(port->fd()));
  reader.core.connect(Steady::now());
  reader.read();
  std::atomic<bool> realtime{false};
  std::thread thread([&] {
    realtime = !normal && cellcal::bench::request_realtime(cellcal::bench::kDriverPriority);
    reader.io.run();
  });

  cellcal::bench::Times times;
  int lost = 0;
  for (int i = 0; i < events; ++i) {
    const auto trip = ctp::build(ctp::Trip{1, 0}, static_cast<std::uint8_t>(i));
    std::this_thread::sleep_for(kBetween);
    reader.seen_ns = 0;
    const auto sent = Steady::now();
    [[maybe_unused]] const auto written = ::write(terminal.master(), trip.data.data(), trip.size);
    std::int64_t seen = 0;
    while ((seen = reader.seen_ns) == 0 && Steady::now() - sent < std::chrono::seconds{1}) {
      std::this_thread::sleep_for(std::chrono::microseconds{200});
    }
    if (seen == 0) {
      ++lost;
    } else {
      times.add(std::chrono::nanoseconds{seen} - sent.time_since_epoch());
    }
  }
  reader.io.stop();
  thread.join();
  fmt::print("contact byte in -> event on the io thread, {} trips, {}\n", events,
             realtime ? "SCHED_FIFO" : "normal priority");
  fmt::print("{:<32} {} {:>6}\n", "us", cellcal::bench::Times::columns(), "lost");
  fmt::print("{:<32} {} {:>6}\n", "terminal, reader, protocol", times.row(), lost);
  return 0;
}
