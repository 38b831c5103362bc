// RSI packet in to reply out over UDP on the loopback, as seen by the controller: the adapter, and
// for comparison a bare echo in the same run. Prints figures; no threshold.

#include <fmt/format.h>
#include <poll.h>
#include <sys/socket.h>

#include <array>
#include <atomic>
#include <numbers>
#include <string>
#include <thread>

#include "drivers/io_thread.h"
#include "drivers/kuka/rsi/rsi_robot.h"
#include "tests/bench/burners.h"
#include "tests/bench/loopback.h"
#include "tests/bench/times.h"
#include "tests/command_line/command_line.h"

namespace {

using namespace cellcal::drivers;  // NOLINT: a benchmark's own file
using namespace cellcal::bench;    // NOLINT
using SteadyClock = std::chrono::steady_clock;

constexpr int kReplyTimeoutMs = 100;

/// Answers each datagram with itself: the time of the machine without any adapter.
class Echo {
 public:
  explicit Echo(bool realtime) : thread_([this, realtime] { run(realtime); }) {}
  ~Echo() {
    stop_ = true;
    thread_.join();
  }
  std::uint16_t port() const { return socket_.port(); }

 private:
  void run(bool realtime) {
    if (realtime) request_realtime(kDriverPriority);
    std::array<char, 2048> buffer{};
    while (!stop_.load()) {
      pollfd ready{socket_.fd(), POLLIN, 0};
      if (::poll(&ready, 1, kReplyTimeoutMs) <= 0) continue;
      sockaddr_storage from{};
      socklen_t size = sizeof from;
      auto* address = reinterpret_cast<sockaddr*>(&from);
      const ssize_t got = ::recvfrom(socket_.fd(), buffer.data(), buffer.size(), 0, address, &size);
      if (got > 0) {
        ::sendto(socket_.fd(), buffer.data(), static_cast<std::size_t>(got), 0, address, size);
      }
    }
  }
  Udp socket_;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

struct Replies {
  Times us;
  int lost = 0;

  void print(const char* what) { fmt::print("{:<32} {} {:>6}\n", what, us.row(), lost); }
};

class Peer {
 public:
  explicit Peer(std::uint16_t port) { socket_.connect(port); }
  void ask(const std::string& packet, Replies& replies) {
    std::array<char, 2048> buffer{};
    const auto begun = SteadyClock::now();
    pollfd ready{socket_.fd(), POLLIN, 0};
    const bool answered = ::send(socket_.fd(), packet.data(), packet.size(), 0) >= 0 &&
                          ::poll(&ready, 1, kReplyTimeoutMs) > 0 &&
                          ::recv(socket_.fd(), buffer.data(), buffer.size(), 0) > 0;
    if (answered) {
      replies.us.add(SteadyClock::now() - begun);
    } else {
      ++replies.lost;
    }
  }

 private:
  Udp socket_;
};

std::string packet(std::uint64_t ipoc) {
  const std::string axes =
      R"(A1="0.0000" A2="-90.0000" A3="90.0000" A4="0.0000" A5="90.0000" A6="0.0000"/>)";
  return R"(<Rob Type="KUKA"><RIst X="0.0000" Y="0.0000" Z="0.0000" A="0.0000" B="0.0000" )"
         R"(C="0.0000"/><AIPos )" +
         axes + "<ASPos " + axes + R"(<Delay D="0"/><IPOC>)" + std::to_string(ipoc) +
         "</IPOC></Rob>";
}

}  // namespace

int main(int argc, char** argv) {
  cellcal::CommandLine app("RSI packet in to reply out, beside a bare echo");
  int count = 2500, cycle_us = 4000, burners = 0;
  bool realtime = false;
  app.option("--count", count, "packets").between(1, 10'000'000);
  app.option("--cycle-us", cycle_us, "cycle").between(500, 100'000);
  app.option("--burners", burners, "threads of normal priority that use the processors up")
      .between(0, 64);
  app.option("--realtime", realtime, "SCHED_FIFO and locked memory for both");
  if (const auto code = app.parse(argc, argv)) return *code;

  RsiConfig config;
  config.bind_address = "127.0.0.1";
  config.port = 0;
  constexpr double kRadPerDeg = std::numbers::pi / 180;
  config.limits.assign(6, {-185 * kRadPerDeg, 185 * kRadPerDeg, 1.0, 5.0, 50.0});
  config.correction_limit_deg.assign(6, 90.0);
  IoThread io(IoThreadOptions{.realtime = realtime});
  io.start();
  RsiRobot robot(io.context(), config, nullptr);
  robot.open();
  Echo echo(realtime);
  Peer to_robot(robot.port()), to_echo(echo.port());

  const Burners load(burners);  // before this thread has a priority that they would inherit
  const bool granted = realtime && request_realtime(kHardwarePriority) && io.warnings().empty();
  Replies adapter, bare;
  auto next = SteadyClock::now();
  for (int i = 0; i < count; ++i) {
    next += std::chrono::microseconds(cycle_us);
    std::this_thread::sleep_until(next);
    const std::string text = packet(1'000'000 + 4 * static_cast<std::uint64_t>(i));
    to_robot.ask(text, adapter);
    to_echo.ask(text, bare);
  }
  fmt::print("RSI packet in -> reply out, {} packets, cycle {} us, {} burners, {}\n", count,
             cycle_us, burners, granted ? "SCHED_FIFO" : "normal priority");
  fmt::print("{:<32} {} {:>6}\n", "us", Times::columns(), "lost");
  adapter.print("RsiRobot, seen by the controller");
  bare.print("bare UDP echo");
  const ReplyHistogram& inside = robot.reply_times();
  fmt::print("{:<32} {:9.1f} {:9.1f} {:9.1f} {:9.1f} {:8d}\n", "RsiRobot, inside the adapter",
             1e6 * inside.quantile_s(0.5), 1e6 * inside.quantile_s(0.99),
             1e6 * inside.quantile_s(0.999), 1e6 * inside.max_s(), inside.count());
  return 0;
}
