#include "tests/bench/cell_peer.h"

#include <poll.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <random>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "drivers/contact/wire/ctp_codec.h"
#include "drivers/kuka/wire/rsi_codec.h"
#include "sim/krc/controller.h"
#include "sim/mcu/microcontroller.h"
#include "tests/bench/loopback.h"
#include "tests/drivers/kuka/wire/sen_frame.h"

namespace cellcal::bench {
namespace {

namespace ctp = drivers::ctp;
using drivers::Duration;
using drivers::TimePoint;
using Steady = std::chrono::steady_clock;
using std::chrono::microseconds;
using std::chrono::milliseconds;

/// Number of changed replies in a row at constant speed: the ramp at search speed takes 28 ms.
constexpr int kSteadyCycles = 12;
/// Maximum delay of a packet that is to follow the byte.
constexpr milliseconds kHoldLimit{2};
/// The echo is requested in the middle of a cycle, well after the reply.
constexpr milliseconds kEchoEarliest{1}, kEchoSpread{1};
constexpr std::size_t kTripBytes = std::size_t{CTP_TRIP_SIZE} + std::size_t{CTP_OVERHEAD};
/// A packet sent this late is due to a stall of the machine, not to the driver.
constexpr milliseconds kStall{1};
constexpr std::size_t kSentKept = 16;

Duration trip_on_the_wire() {
  return std::chrono::nanoseconds{std::int64_t{1'000'000'000} * CTP_BITS_PER_BYTE /
                                  CTP_DEFAULT_BAUD * static_cast<std::int64_t>(kTripBytes)};
}

timespec to_timespec(Duration d) {
  const auto ns = std::max<std::int64_t>(0, std::chrono::nanoseconds(d).count());
  return {ns / 1'000'000'000, ns % 1'000'000'000};
}

}  // namespace

struct CellPeer::Impl {
  explicit Impl(const PeerOptions& o)
      : options(o), controller(config(o)), mcu({}, Steady::now()), random(o.seed) {}

  static sim::ControllerConfig config(const PeerOptions& o) {
    sim::ControllerConfig c;
    c.cycle_ms = o.cycle_ms;
    c.seed = o.seed;
    return c;
  }

  // ---- the peer's thread -----------------------------------------------------------------------

  void run() {
    ::prctl(PR_SET_TIMERSLACK, 1UL);  // otherwise timed waits are 50 us late to save wake-ups
    if (options.realtime) granted = request_realtime(kHardwarePriority);
    controller.rsi_on();
    next_packet = Steady::now() + controller.cycle();
    while (!stopping.load()) {
      if (silent_from && stage == Stage::kAwaitingSpeed && Steady::now() >= *silent_from) {
        stage = Stage::kSilent;
        mcu.set_faults({.silent = true}, Steady::now());
      }
      speak_as_sensor();
      if (echo_at && Steady::now() >= *echo_at) ask_echo();
      if (Steady::now() >= packet_due()) send_packet();
      wait();
    }
  }

  void speak_as_sensor() {
    mcu.advance(Steady::now());
    while (const auto output = mcu.next_output()) {
      bool trip = false;
      for (const std::uint8_t byte : output->frame.bytes()) {
        const ctp::Frame* frame = listener.feed(byte);
        trip = trip || (frame != nullptr && frame->type == CTP_TRIP);
      }
      const bool ours = trip && stage == Stage::kEdgeSet;
      if (ours && gap) prepare_packet();  // so that only the gap separates the two
      const TimePoint now = Steady::now();
      last_frame_at = now;  // bytes already on the wire still arrive
      // Frames that do not fit are lost, as on a real line.
      [[maybe_unused]] const auto written =
          ::write(sensor.master(), output->frame.data.data(), output->frame.size);
      if (ours) {
        stage = Stage::kWritten;
        byte_at = now;
      }
    }
  }

  TimePoint packet_due() const {
    if (!gap) return next_packet;
    if (stage == Stage::kEdgeSet) return next_packet + kHoldLimit;
    if (stage == Stage::kWritten && !first_ipoc) return byte_at + *gap;
    return next_packet;
  }

  void prepare_packet() {
    if (!packet.empty()) return;
    packet = controller.tick(next_packet);
    if (!answered) ++late;
    answered = false;
  }

  void send_packet() {
    prepare_packet();
    const std::string_view bytes = std::exchange(packet, {});
    const TimePoint now = Steady::now();
    if (!gap && now - next_packet > kStall) ++stalls;
    next_packet += controller.cycle();
    while (next_packet <= now) next_packet += controller.cycle();
    if (bytes.empty()) return;
    ++packets;
    const auto ipoc = static_cast<std::uint32_t>(controller.ipoc());
    const TimePoint sent_at = Steady::now();
    sent[ipoc / static_cast<std::uint32_t>(options.cycle_ms) % kSentKept] = {ipoc, sent_at};
    // Fails if the robot does not listen; the controller counts it as a late reply.
    (void)::send(to_robot.fd(), bytes.data(), bytes.size(), 0);
    if (stage == Stage::kWritten && !first_ipoc) {
      first_ipoc = ipoc;
      contact.byte_to_packet = sent_at - byte_at;
    }
    obey(sent_at);
  }

  void obey(TimePoint now) {
    if (touch_asked.exchange(false)) {
      stage = Stage::kAwaitingSpeed;
      gap = gap_asked;
      first_ipoc.reset();
      seen_frozen = false;
      contact = {};
    }
    if (silence_asked.exchange(false)) {
      stage = Stage::kAwaitingSpeed;
      going_silent = true;
    }
    if (release_asked.exchange(false)) {
      stage = Stage::kIdle;
      gap.reset();
      going_silent = false;
      silent_from.reset();
      mcu.set_faults({}, now);
      mcu.edge(std::max(now, edge_at) + microseconds{1}, false);
    }
    if (echo_asked.exchange(false)) echo_at = now + kEchoEarliest + share() * kEchoSpread;
    if (stage != Stage::kAwaitingSpeed || steady_cycles < kSteadyCycles) return;
    if (going_silent) {
      if (!silent_from) silent_from = now + share() * controller.cycle();
      return;
    }
    stage = Stage::kEdgeSet;
    edge_at = gap ? next_packet - *gap - trip_on_the_wire() : now + share() * controller.cycle();
    mcu.edge(edge_at, true);
  }

  /// A random share of a whole.
  struct Share {
    double of_one;
    Duration operator*(Duration whole) const {
      return std::chrono::duration_cast<Duration>(of_one * whole);
    }
  };
  Share share() { return {std::uniform_real_distribution<double>(0.0, 1.0)(random)}; }

  void ask_echo() {
    echo_at.reset();
    const std::array<std::uint8_t, kTripBytes> bytes{};
    echo_sent = Steady::now();
    [[maybe_unused]] const auto written =
        ::write(echo_terminal.master(), bytes.data(), bytes.size());
  }

  void wait() {
    TimePoint until = std::min(packet_due(), mcu.next_event());
    if (silent_from && stage == Stage::kAwaitingSpeed) until = std::min(until, *silent_from);
    if (echo_at) until = std::min(until, *echo_at);
    const timespec timeout = to_timespec(until - Steady::now());
    std::array<pollfd, 3> ends{
        {{to_robot.fd(), POLLIN, 0}, {sensor.master(), POLLIN, 0}, {from_echo.fd(), POLLIN, 0}}};
    if (::ppoll(ends.data(), ends.size(), &timeout, nullptr) <= 0) return;
    const TimePoint now = Steady::now();
    std::array<char, drivers::kMaxRsiDatagram> buffer{};
    if ((ends[0].revents & POLLIN) != 0) {
      const ssize_t got = ::recv(to_robot.fd(), buffer.data(), buffer.size(), MSG_DONTWAIT);
      if (got > 0) receive_reply({buffer.data(), static_cast<std::size_t>(got)}, now);
    }
    if ((ends[1].revents & POLLIN) != 0) {
      const ssize_t got = ::read(sensor.master(), buffer.data(), buffer.size());
      if (got > 0) {
        mcu.receive(
            {reinterpret_cast<const std::uint8_t*>(buffer.data()), static_cast<std::size_t>(got)},
            now);
      }
    }
    if ((ends[2].revents & POLLIN) != 0 &&
        ::recv(from_echo.fd(), buffer.data(), buffer.size(), MSG_DONTWAIT) > 0) {
      echo = now - echo_sent;
      echo_ready = true;
    }
  }

  void receive_reply(std::string_view bytes, TimePoint now) {
    const auto reply = drivers::read_sen(bytes);
    if (!reply) return;
    controller.receive(bytes);
    const std::uint32_t ipoc = static_cast<std::uint32_t>(std::stoull(reply->ipoc));
    if (ipoc == static_cast<std::uint32_t>(controller.ipoc())) answered = true;
    const bool frozen = reply->axes_deg == last_deg;
    last_deg = reply->axes_deg;
    steady_cycles = frozen ? 0 : steady_cycles + 1;
    if (stage == Stage::kSilent && frozen) {
      silence.to_frozen = now - last_frame_at;
      stage = Stage::kIdle;
      silence_ready = true;
    }
    if (stage != Stage::kWritten) return;
    if (frozen && !seen_frozen) {
      seen_frozen = true;
      contact.byte_to_frozen = now - byte_at;
      const Sent& asked = sent[ipoc / static_cast<std::uint32_t>(options.cycle_ms) % kSentKept];
      if (asked.ipoc == ipoc) contact.packet_to_frozen = now - asked.at;
    }
    if (first_ipoc && ipoc == *first_ipoc) contact.frozen_at_once = frozen;
    if (seen_frozen && first_ipoc && ipoc >= *first_ipoc) {
      stage = Stage::kIdle;
      gap.reset();
      contact_ready = true;
    }
  }

  const PeerOptions options;
  Udp to_robot, from_echo;
  Terminal sensor, echo_terminal;
  sim::Controller controller;
  sim::Microcontroller mcu;
  std::mt19937_64 random;
  ctp::FrameReader listener{ctp::Direction::kFromSensor};

  // the wires
  struct Sent {
    std::uint32_t ipoc = 0;
    TimePoint at{};
  };
  std::array<Sent, kSentKept> sent{};
  TimePoint next_packet{};
  std::string_view packet;  ///< ready to be sent
  bool answered = true;
  std::vector<double> last_deg;
  int steady_cycles = 0;
  std::optional<TimePoint> echo_at;
  TimePoint echo_sent{};

  // the current contact
  enum class Stage { kIdle, kAwaitingSpeed, kEdgeSet, kWritten, kSilent } stage = Stage::kIdle;
  bool going_silent = false;
  std::optional<TimePoint> silent_from;
  TimePoint last_frame_at{};
  std::optional<Duration> gap;
  TimePoint edge_at{}, byte_at{};
  std::optional<std::uint32_t> first_ipoc;
  bool seen_frozen = false;

  // between the threads: data are written before their flag is set
  std::optional<Duration> gap_asked;
  Contact contact;
  Silence silence;
  Duration echo{};
  std::atomic<bool> touch_asked{false}, release_asked{false}, echo_asked{false};
  std::atomic<bool> silence_asked{false}, silence_ready{false};
  std::atomic<bool> contact_ready{false}, echo_ready{false};
  std::atomic<bool> stopping{false}, granted{false};
  std::atomic<std::uint64_t> late{0}, stalls{0}, packets{0};
  std::thread thread;
};

CellPeer::CellPeer(const PeerOptions& options) : impl_(std::make_unique<Impl>(options)) {}

CellPeer::~CellPeer() { stop(); }

const std::string& CellPeer::sensor_path() const { return impl_->sensor.path(); }
const std::string& CellPeer::echo_path() const { return impl_->echo_terminal.path(); }
std::uint16_t CellPeer::echo_port() const { return impl_->from_echo.port(); }

void CellPeer::start(std::uint16_t robot_port) {
  impl_->to_robot.connect(robot_port);
  impl_->thread = std::thread([impl = impl_.get()] { impl->run(); });
}

void CellPeer::stop() {
  impl_->stopping = true;
  if (impl_->thread.joinable()) impl_->thread.join();
}

void CellPeer::touch(std::optional<Duration> gap) {
  impl_->contact_ready = false;
  impl_->gap_asked = gap;
  impl_->touch_asked = true;
}

std::optional<Contact> CellPeer::consume_contact() {
  if (!impl_->contact_ready.exchange(false)) return std::nullopt;
  return impl_->contact;
}

void CellPeer::fall_silent() {
  impl_->silence_ready = false;
  impl_->silence_asked = true;
}

std::optional<Silence> CellPeer::consume_silence() {
  if (!impl_->silence_ready.exchange(false)) return std::nullopt;
  return impl_->silence;
}

void CellPeer::release() {
  impl_->touch_asked = false;
  impl_->release_asked = true;
}

void CellPeer::ping_echo() {
  impl_->echo_ready = false;
  impl_->echo_asked = true;
}

std::optional<Duration> CellPeer::consume_echo() {
  if (!impl_->echo_ready.exchange(false)) return std::nullopt;
  return impl_->echo;
}

bool CellPeer::realtime() const { return impl_->granted; }
PeerCounts CellPeer::counts() const { return {impl_->packets, impl_->late, impl_->stalls}; }
std::string CellPeer::pendant() const {
  const bool faulted = impl_->controller.phase() == sim::RsiPhase::kFaulted;
  return faulted ? impl_->controller.message() : std::string();
}

}  // namespace cellcal::bench
