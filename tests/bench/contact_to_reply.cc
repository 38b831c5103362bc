// From contact byte to frozen reply, through the whole stack as built by the daemon: SerialContact
// on a pseudo-terminal and RsiRobot on UDP share one IoThread; the other ends are the emulated
// sensor and controller. For comparison, in the same run, a bare echo: a thread that reads the
// terminal and sends a datagram. Prints figures; no threshold.
//
// A reply is frozen if its correction equals that of the preceding reply. Every other search goes
// in the opposite direction, so that the arm stays in place.

#include <fmt/format.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <map>
#include <thread>

#include "drivers/contact/port/port.h"
#include "tests/bench/burners.h"
#include "tests/bench/cell_peer.h"
#include "tests/bench/cell_session.h"
#include "tests/bench/loopback.h"
#include "tests/bench/times.h"
#include "tests/command_line/command_line.h"

namespace {

using namespace cellcal::drivers;  // NOLINT: a benchmark's own file
using namespace cellcal::bench;    // NOLINT
using Steady = std::chrono::steady_clock;
using std::chrono::microseconds;

constexpr int kEchoPollMs = 100;

struct Options {
  int trials = 500, gap_trials = 60, silences = 100, burners = 0;
  std::vector<int> gaps_us = {0, 50, 100, 200, 500};
  CellSessionOptions session;
  PeerOptions peer;
};

/// Reads a terminal and sends a datagram: the time of the machine without any driver.
class BareEcho {
 public:
  BareEcho(const CellPeer& peer, bool realtime)
      : port_(open_port({peer.echo_path(), CTP_DEFAULT_BAUD})) {
    socket_.connect(peer.echo_port());
    thread_ = std::thread([this, realtime] { run(realtime); });
  }
  ~BareEcho() {
    stop_ = true;
    thread_.join();
  }

 private:
  void run(bool realtime) {
    if (realtime) request_realtime(kDriverPriority);
    std::array<char, 256> bytes{};
    while (!stop_.load()) {
      pollfd ready{port_->fd(), POLLIN, 0};
      if (::poll(&ready, 1, kEchoPollMs) <= 0) continue;
      const ssize_t got = ::read(port_->fd(), bytes.data(), bytes.size());
      if (got > 0) ::send(socket_.fd(), bytes.data(), static_cast<std::size_t>(got), 0);
    }
  }
  std::unique_ptr<Port> port_;
  Udp socket_;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

/// Contacts of one kind.
struct Figures {
  Times gap, to_frozen, packet_to_frozen;
  std::vector<double> missed_us;  ///< byte to packet, if the reply to that packet still moved

  void add(const Contact& contact) {
    gap.add(contact.byte_to_packet);
    to_frozen.add(contact.byte_to_frozen);
    packet_to_frozen.add(contact.packet_to_frozen);
    if (!contact.frozen_at_once) {
      missed_us.push_back(cellcal::bench::microseconds(contact.byte_to_packet));
    }
  }
  std::string share() const {
    return fmt::format("{} of {}", gap.count() - missed_us.size(), gap.count());
  }
};

void print(Figures& any, std::map<int, Figures>& gaps, Times& echo, Times& silences) {
  fmt::print("{:<48} {}\n", "us", Times::columns());
  fmt::print("{:<48} {}\n", "byte at any time of the cycle -> frozen reply", any.to_frozen.row());
  fmt::print("{:<48} {}\n", "  of that, packet out -> frozen reply in", any.packet_to_frozen.row());
  fmt::print("{:<48} {}\n", "bare echo: bytes into terminal -> datagram", echo.row());
  fmt::print("{:<48} {}\n", "sensor's last frame -> frozen reply", silences.row());
  fmt::print("first packet after the byte answered by a frozen reply: {}", any.share());
  if (!any.missed_us.empty()) {
    std::sort(any.missed_us.begin(), any.missed_us.end());
    fmt::print("; in the others the byte came {:.0f} us before the packet",
               fmt::join(any.missed_us, ", "));
  }
  fmt::print(
      "\n\npacket right after the byte\n"
      "gap, us: asked   really    frozen in         byte -> frozen reply, us     p50 in bare\n"
      "                    p50   that reply         p50       p99     worst          echoes\n");
  for (auto& [us, figures] : gaps) {
    Times& times = figures.to_frozen;
    fmt::print("{:>14} {:>8.0f} {:>12}   {:>9.1f} {:>9.1f} {:>9.1f} {:>15.1f}\n", us,
               figures.gap.quantile(0.5), figures.share(), times.quantile(0.5),
               times.quantile(0.99), times.worst(), times.quantile(0.5) / echo.quantile(0.5));
  }
}

int run(const Options& options) {
  CellPeer peer(options.peer);
  Figures any;
  std::map<int, Figures> gaps;
  Times echo, silences;
  const Burners load(options.burners);
  bool realtime = false;
  PeerCounts counts;
  {
    BareEcho bare(peer, options.peer.realtime);
    CellSession session(peer, options.session);
    std::vector<std::optional<int>> order(static_cast<std::size_t>(options.trials));
    for (int i = 0; i < options.gap_trials; ++i) {
      for (const int us : options.gaps_us) order.emplace_back(us);
    }
    session.wait_until_ready();
    const PeerCounts before = peer.counts();
    for (const std::optional<int>& us : order) {
      const auto contact =
          session.search(us ? std::optional<Duration>(microseconds{*us}) : std::nullopt);
      if (contact) (us ? gaps[*us] : any).add(*contact);
      peer.ping_echo();
      std::optional<Duration> answer;
      eventually([&] { return (answer = peer.consume_echo()).has_value(); });
      if (answer) echo.add(*answer);
    }
    for (int i = 0; i < options.silences; ++i)
      if (const auto silence = session.lose_heartbeat()) silences.add(silence->to_frozen);
    realtime = session.realtime() && peer.realtime();
    fmt::print(
        "contact byte in -> frozen reply out, {} searches at {:.1f} mrad/s, cycle {} ms, {} "
        "burners, {}\n",
        order.size(), options.session.speed_mrad_s, options.peer.cycle_ms, options.burners,
        realtime ? "SCHED_FIFO" : "normal priority");
    counts = peer.counts();
    counts = {counts.packets - before.packets, counts.late - before.late,
              counts.stalls - before.stalls};
    for (const auto& [why, count] : session.spoilt()) {
      fmt::print("not measured: {} ({})\n", count, why);
    }
  }
  peer.stop();
  print(any, gaps, echo, silences);
  fmt::print(
      "packets {}, of them not answered before the next: {}, sent 1 ms late by the machine: {}\n",
      counts.packets, counts.late, counts.stalls);
  if (!peer.pendant().empty()) fmt::print("controller: {}\n", peer.pendant());
  return any.to_frozen.count() > 0 ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  cellcal::CommandLine app{
      "Contact byte in to frozen reply out, through the drivers, beside a bare echo."};
  Options options;
  bool normal = false;
  app.option("--trials", options.trials, "Contacts at any time of the cycle").between(1, 1'000'000);
  app.option("--gap-trials", options.gap_trials, "Contacts per gap").between(0, 1'000'000);
  app.option("--gaps-us", options.gaps_us, "Packet follows the byte by this").between(0, 3000);
  app.option("--silences", options.silences, "Searches during which the sensor falls silent")
      .between(0, 1'000'000);
  app.option("--burners", options.burners, "Threads of normal priority that use processors up")
      .between(0, 64);
  app.option("--speed-mrad-s", options.session.speed_mrad_s, "Of the searching axis")
      .between(0.1, 30.0);
  app.option("--cycle-ms", options.peer.cycle_ms, "4 or 12").one_of({"4", "12"});
  app.option("--seed", options.peer.seed, "Of the phases");
  app.option("--normal-priority", normal, "Do not ask for real time");
  if (const auto code = app.parse(argc, argv)) return *code;
  options.peer.realtime = options.session.realtime = !normal;
  try {
    return run(options);
  } catch (const std::exception& e) {
    fmt::print(stderr, "contact_to_reply: {}\n", e.what());
    return 1;
  }
}
