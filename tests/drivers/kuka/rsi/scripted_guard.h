#pragma once
// A scripted contact sensor.

#include <cstdint>
#include <deque>
#include <optional>

#include "drivers/contact.h"

namespace cellcal::drivers {

/// The sensor's messages as set by the test.
class ScriptedGuard final : public ContactGuard {
 public:
  ContactSnapshot snapshot(TimePoint now) override {
    if (heard_) now_.said = now;
    return now_;
  }
  std::optional<ContactEvent> pop_event() override {
    if (events_.empty()) return std::nullopt;
    const ContactEvent oldest = events_.front();
    events_.pop_front();
    return oldest;
  }

  void set_silence_limit(Duration limit) override { silence_limit_ = limit; }
  Duration silence_limit() const { return silence_limit_; }

  void arm(std::uint16_t id) {
    now_.armed = true;
    now_.arm_id = id;
  }
  void disarm() { now_.armed = false; }
  void set_alive(bool alive) { now_.alive = alive; }
  /// No data, but not yet silent.
  void set_heard(bool heard) { heard_ = heard; }
  /// Delay of its current message.
  void set_said_late(double late_s) { now_.said_late_s = late_s; }
  /// Ends the arming with this result.
  void end_arming(ArmEnd end) {
    now_.armed = false;
    now_.last_end = end;
  }
  /// Later data shows that the computer processed the sensor's bytes late.
  void set_delivered_late(double late_s, double limit_s) {
    now_.delivered_late_s = late_s;
    now_.late_limit_s = limit_s;
  }
  void touch(bool touching) { now_.in_contact = touching; }
  /// Time of its newest message from now on.
  void set_said(TimePoint said) {
    heard_ = false;
    now_.said = said;
  }
  /// The sensor's one-shot arming ends with its trip.
  void trip(std::uint16_t id, TimePoint edge) {
    now_.armed = false;
    push(ContactEventKind::kTrip, id, edge);
  }
  void push(ContactEventKind kind, std::uint16_t id, TimePoint edge, int bounces = 0) {
    push({kind, id, edge, 20e-6, bounces});
  }

  void push(const ContactEvent& event) { events_.push_back(event); }

 private:
  bool heard_ = true;
  Duration silence_limit_{kHeartbeatLimit};
  ContactSnapshot now_{.alive = true};
  std::deque<ContactEvent> events_;
};

}  // namespace cellcal::drivers
