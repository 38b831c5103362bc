#include "drivers/contact/contact_inline.h"

#include <algorithm>
#include <array>

#include "drivers/contact/contact_words.h"

namespace cellcal::drivers {

namespace {

constexpr std::size_t kChunk = CTP_MAX_WIRE;

}  // namespace

ContactInline::ContactInline(const ContactOptions& options, const Clock& clock, ByteLine& line)
    : clock_(clock), line_(line), core_(options, [this](std::span<const std::uint8_t> bytes) {
        line_.write(bytes, write_time_);
      }) {}

void ContactInline::open() {
  open_ = true;
  now_ = write_time_ = clock_.now();
  line_.advance(write_time_);
  // Discards what was sent before the port was open.
  std::array<std::uint8_t, kChunk> unheard{};
  for (TimePoint t; line_.read(unheard, t) > 0;) continue;
  core_.connect(write_time_);
}

void ContactInline::close() {
  if (!open_) return;
  open_ = false;
  core_.disarm(clock_.now());
  core_.disconnect(clock_.now());
}

ContactStatus ContactInline::status() const { return status_of(core_.facts(clock_.now())); }

void ContactInline::arm(std::uint16_t arm_id, std::chrono::milliseconds lifetime) {
  write_time_ = clock_.now();
  core_.arm(arm_id, lifetime, write_time_);
}

std::optional<ArmResult> ContactInline::poll_arm() {
  const auto answer = core_.poll_arm();
  if (!answer) return std::nullopt;
  return result_of(*answer);
}

void ContactInline::disarm() {
  write_time_ = clock_.now();
  core_.disarm(write_time_);
}

void ContactInline::self_test() {
  write_time_ = clock_.now();
  core_.self_test(write_time_);
}

void ContactInline::run_until(TimePoint t) {
  std::array<std::uint8_t, kChunk> bytes{};
  for (;;) {
    // Never decreases: overdue actions happen now.
    const TimePoint due = std::max(now_, std::min({core_.next_wake(), line_.next(), t}));
    now_ = due;
    line_.advance(due);
    TimePoint arrived = due;
    while (const std::size_t size = line_.read(bytes, arrived)) {
      write_time_ = arrived;
      core_.on_bytes({bytes.data(), size}, arrived);
    }
    if (core_.next_wake() <= due) {
      write_time_ = due;
      core_.on_tick(due);
    }
    if (due >= t && core_.next_wake() > due && line_.next() > due) return;
  }
}

}  // namespace cellcal::drivers
