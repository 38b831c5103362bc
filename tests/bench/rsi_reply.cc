// RSI packet in to reply out over UDP on the loopback, seen from the controller's side: the adapter
// beside a bare echo in the same run. Prints, and gates nothing.
//
//   rsi_reply [--count N] [--cycle-us N] [--realtime]

#include <arpa/inet.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <numbers>
#include <string>
#include <thread>
#include <vector>

#include "drivers/io_thread.h"
#include "drivers/kuka/rsi_robot.h"

namespace {

using namespace cellcal::drivers;
using SteadyClock = std::chrono::steady_clock;

constexpr int kReplyTimeoutMs = 100;

struct Udp {
  Udp() : fd(::socket(AF_INET, SOCK_DGRAM, 0)) {
    sockaddr_in any{};
    any.sin_family = AF_INET;
    any.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    if (fd < 0 || ::bind(fd, reinterpret_cast<sockaddr*>(&any), sizeof any) != 0) {
      throw std::runtime_error("rsi_reply: no UDP socket on the loopback");
    }
  }
  ~Udp() { ::close(fd); }
  Udp(const Udp&) = delete;
  Udp& operator=(const Udp&) = delete;

  std::uint16_t port() const {
    sockaddr_in self{};
    socklen_t size = sizeof self;
    ::getsockname(fd, reinterpret_cast<sockaddr*>(&self), &size);
    return ntohs(self.sin_port);
  }
  int fd;
};

void ask_for_realtime(const char* who, int priority) {
  sched_param param{};
  param.sched_priority = priority;
  if (pthread_setschedparam(pthread_self(), SCHED_FIFO, &param) != 0) {
    fmt::print("{}: no SCHED_FIFO\n", who);
  }
}

/// Answers each datagram with itself: what the machine takes without any adapter.
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
    if (realtime) ask_for_realtime("echo", IoThreadOptions{}.priority);
    std::array<char, 2048> buffer{};
    while (!stop_.load()) {
      pollfd ready{socket_.fd, POLLIN, 0};
      if (::poll(&ready, 1, kReplyTimeoutMs) <= 0) continue;
      sockaddr_in from{};
      socklen_t size = sizeof from;
      const ssize_t got = ::recvfrom(socket_.fd, buffer.data(), buffer.size(), 0,
                                     reinterpret_cast<sockaddr*>(&from), &size);
      if (got > 0) {
        ::sendto(socket_.fd, buffer.data(), static_cast<std::size_t>(got), 0,
                 reinterpret_cast<sockaddr*>(&from), size);
      }
    }
  }
  Udp socket_;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

struct Times {
  std::vector<double> us;
  int lost = 0;

  void print(const char* what) {
    std::sort(us.begin(), us.end());
    if (us.empty()) return fmt::print("{:<12} no reply at all\n", what);
    const auto quantile = [&](double p) {
      return us[std::min(us.size() - 1,
                         static_cast<std::size_t>(p * static_cast<double>(us.size())))];
    };
    fmt::print(
        "{:<12} p50 {:7.1f}  p99 {:7.1f}  p99.9 {:7.1f}  max {:7.1f} us   {} replies, {} lost\n",
        what, quantile(0.5), quantile(0.99), quantile(0.999), us.back(), us.size(), lost);
  }
};

class Peer {
 public:
  explicit Peer(std::uint16_t port) {
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    to.sin_port = htons(port);
    if (::connect(socket_.fd, reinterpret_cast<sockaddr*>(&to), sizeof to) != 0) {
      throw std::runtime_error("rsi_reply: cannot address the loopback");
    }
  }
  void ask(const std::string& packet, Times& times) {
    const auto begun = SteadyClock::now();
    if (::send(socket_.fd, packet.data(), packet.size(), 0) < 0) {
      ++times.lost;
      return;
    }
    pollfd ready{socket_.fd, POLLIN, 0};
    if (::poll(&ready, 1, kReplyTimeoutMs) <= 0) {
      ++times.lost;
      return;
    }
    std::array<char, 2048> buffer{};
    if (::recv(socket_.fd, buffer.data(), buffer.size(), 0) <= 0) {
      ++times.lost;
      return;
    }
    times.us.push_back(
        std::chrono::duration<double, std::micro>(SteadyClock::now() - begun).count());
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
  CLI::App app("RSI reply times beside a bare echo");
  int count = 2500, cycle_us = 4000;
  bool realtime = false;
  app.add_option("--count", count, "packets")->check(CLI::Range(1, 10'000'000));
  app.add_option("--cycle-us", cycle_us, "cycle")->check(CLI::Range(500, 100'000));
  app.add_flag("--realtime", realtime, "SCHED_FIFO and locked memory for both");
  CLI11_PARSE(app, argc, argv);

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

  // The peer stands for hardware: its own delays are not the adapter's.
  if (realtime) ask_for_realtime("peer", IoThreadOptions{}.priority + 10);
  Times adapter, bare;
  auto next = SteadyClock::now();
  for (int i = 0; i < count; ++i) {
    next += std::chrono::microseconds(cycle_us);
    std::this_thread::sleep_until(next);
    const std::string text = packet(1'000'000 + 4 * static_cast<std::uint64_t>(i));
    to_robot.ask(text, adapter);
    to_echo.ask(text, bare);
  }
  fmt::print("{} packets, cycle {} us, {}\n", count, cycle_us,
             realtime ? "real time asked for" : "normal priority");
  adapter.print("RsiRobot");
  bare.print("bare echo");
  const ReplyHistogram& inside = robot.reply_times();
  fmt::print("inside       p50 {:7.1f}  p99 {:7.1f}  p99.9 {:7.1f}  max {:7.1f} us\n",
             1e6 * inside.quantile_s(0.5), 1e6 * inside.quantile_s(0.99),
             1e6 * inside.quantile_s(0.999), 1e6 * inside.max_s());
  return 0;
}
