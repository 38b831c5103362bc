// Any bytes on the line, from either end: the reader, the host's side and the emulated sensor stay
// within their bounds and guarantees. Also replayed over ctp_corpus as an ordinary test.

#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <span>
#include <string>

#include "drivers/contact/contact_core.h"
#include "drivers/contact/firmware/core/host_link.h"
#include "drivers/contact/firmware/core/sensor.h"
#include "drivers/contact/firmware/w5500/w5500.h"
#include "drivers/contact/port/port.h"
#include "sim/mcu/microcontroller.h"

namespace {

using namespace cellcal;  // NOLINT: a fuzz target's own file
namespace ctp = drivers::ctp;
using drivers::TimePoint;
using std::chrono::microseconds;

constexpr TimePoint kStart{std::chrono::hours{1}};

void require(bool condition, const char* what) {
  if (condition) return;
  std::fprintf(stderr, "broken promise: %s\n", what);
  std::abort();
}

/// An accepted frame equals the frame built from its content.
void frames_build_back(std::span<const std::uint8_t> bytes, ctp::Direction direction) {
  ctp::FrameReader reader(direction);
  ctp::FrameReader again(direction);
  for (const std::uint8_t byte : bytes) {
    const ctp::Frame* frame = reader.feed(byte);
    if (frame == nullptr) continue;
    const ctp::WireBytes wire =
        ctp::build_frame(frame->type, frame->seq, {frame->payload.data(), frame->size});
    require(wire.size == frame->size + std::size_t{CTP_OVERHEAD}, "size on the wire");
    const ctp::Frame* back = nullptr;
    for (const std::uint8_t b : wire.bytes()) back = again.feed(b);
    require(back != nullptr && back->payload == frame->payload && back->type == frame->type,
            "a frame that was read can be built and read again");
  }
}

/// The first byte of each chunk of 16 is the time before it.
void host_stays_sane(std::span<const std::uint8_t> bytes) {
  constexpr std::size_t kChunk = 16;
  TimePoint now = kStart;
  drivers::ContactOptions options;
  options.datagrams = !bytes.empty() && bytes[0] % 2 == 0;
  drivers::ContactCore core(options, [](std::span<const std::uint8_t> out) {
    require(!out.empty() && out.size() <= CTP_MAX_WIRE, "output is one frame");
  });
  core.connect(now);
  for (std::size_t i = 0; i < bytes.size(); i += kChunk) {
    now += microseconds{1 + 100 * bytes[i]};
    core.on_bytes(bytes.subspan(i, std::min(kChunk, bytes.size() - i)), now);
    core.on_tick(now);
    if (bytes[i] % 7 == 0) core.arm(bytes[i], std::chrono::milliseconds{1000}, now);
    if (bytes[i] % 11 == 0) core.self_test(now);
    while (const auto answer = core.poll_arm()) {
      require(answer->refusal != drivers::ArmRefusal::kNone || answer->facts.armed, "armed");
    }
    while (const auto event = core.pop_event()) {
      require(std::isfinite(event->time_sigma_s) && event->time_sigma_s > 0, "sigma");
    }
    require(!core.snapshot(now + std::chrono::seconds{1}).alive, "silence is not life");
  }
}

void sensor_stays_sane(std::span<const std::uint8_t> bytes) {
  sim::Microcontroller mcu({}, kStart);
  mcu.receive(bytes, kStart);
  TimePoint now = kStart;
  for (int i = 0; i < 50; ++i) {
    mcu.advance(now += std::chrono::milliseconds{2});
    while (const auto out = mcu.next_output()) require(out->t <= now, "output is not early");
  }
}

/// Every eighth byte is an edge and a time step, the others are from the host.
void firmware_stays_sane(std::span<const std::uint8_t> bytes) {
  sensor s{};
  sensor_identity identity{};
  identity.version = CTP_VERSION;
  identity.baud = CTP_DEFAULT_BAUD;
  std::uint32_t now = 0xFFFFFFFFu - CTP_TICKS_PER_S;  // wraps soon
  sensor_init(&s, &identity, now);
  std::array<std::uint8_t, CTP_MAX_WIRE> wire{};
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    if (i % 8 == 0) {
      now += 1u + 100u * bytes[i];
      sensor_on_edge(&s, now, bytes[i] % 2 == 0);
      const sensor_voltages mv{static_cast<std::uint16_t>(bytes[i] * 20), 5000,
                               static_cast<std::uint16_t>(bytes[i] * 17)};
      sensor_on_voltages(&s, now, &mv);
    } else {
      sensor_on_byte(&s, bytes[i], now += 20);
    }
    sensor_run(&s, now);
    std::uint32_t start = 0;
    const std::size_t size = sensor_next_frame(&s, now, wire.data(), &start);
    require(size <= wire.size() && (size == 0 || wire[size - 1] == 0), "the firmware's frame");
    require(s.event_count <= SENSOR_EVENTS && s.nak_count <= SENSOR_NAKS &&
                s.pong_count <= SENSOR_PONGS,
            "the firmware's queues");
    require(s.arm_id == 0 || s.self_test_ok, "armed without a self-test");
  }
}

bool has_greeted(std::span<const std::uint8_t> bytes) {
  ctp::FrameReader reader(ctp::Direction::kFromHost);
  for (const std::uint8_t byte : bytes) {
    const ctp::Frame* frame = reader.feed(byte);
    if (frame != nullptr) return frame->type == CTP_HELLO;
  }
  return false;
}

/// Datagrams: a byte with sender and length, a byte with the time before it, then the content.
void the_board_answers_its_host_alone(std::span<const std::uint8_t> bytes) {
  sensor s{};
  sensor_identity identity{};
  identity.version = CTP_VERSION;
  identity.baud = CTP_DEFAULT_BAUD;
  identity.datagrams = true;
  sensor_init(&s, &identity, 0);
  host_link link{};
  host_link_init(&link, &s);
  std::uint32_t now = 0;
  while (bytes.size() >= 2) {
    const host_address from{bytes[0] & 3u, 1};
    const std::size_t size = std::min<std::size_t>(bytes[0] >> 2, bytes.size() - 2);
    now += bytes[1] * 20'000u;
    const std::span<const std::uint8_t> datagram = bytes.subspan(2, size);
    const bool was_host = link.there && link.host.address == from.address;
    host_link_take(&link, &from, datagram.data(), static_cast<std::uint16_t>(size), now);
    const bool is_host = link.there && link.host.address == from.address;
    require(!is_host || was_host || has_greeted(datagram), "a host without a greeting");
    bytes = bytes.subspan(2 + size);
  }
}

/// Responses of the chip, byte by byte.
void any_chip_stays_within_its_room(std::span<const std::uint8_t> bytes) {
  struct Chip {
    std::span<const std::uint8_t> answers;
    std::size_t at = 0;
  } answers{bytes};
  w5500 chip{};
  chip.bus = {[](void*, bool) {},
              [](void* self, std::uint8_t) -> std::uint8_t {
                auto* chip_answers = static_cast<Chip*>(self);
                if (chip_answers->at >= chip_answers->answers.size()) return 0;
                return chip_answers->answers[chip_answers->at++];
              },
              &answers};
  std::array<std::uint8_t, 65> into{};
  into.back() = 0xA5;
  while (answers.at < bytes.size()) {
    w5500_peer from{};
    w5500_receive(&chip, &from, into.data(), static_cast<std::uint16_t>(into.size() - 1));
    require(into.back() == 0xA5, "written beyond its room");
    if (w5500_free(&chip)) {
      w5500_load(&chip, &from, into.data(), 20);
      w5500_go(&chip);
    }
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::span<const std::uint8_t> bytes(data, size);
  frames_build_back(bytes, ctp::Direction::kFromSensor);
  frames_build_back(bytes, ctp::Direction::kFromHost);
  the_board_answers_its_host_alone(bytes);
  any_chip_stays_within_its_room(bytes);
  drivers::udp_device_of("udp:" + std::string(bytes.begin(), bytes.end()));
  host_stays_sane(bytes);
  sensor_stays_sane(bytes);
  firmware_stays_sane(bytes);
  return 0;
}
