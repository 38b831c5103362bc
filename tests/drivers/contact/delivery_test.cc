// Origin of a silence: the sensor, or a computer that processed its bytes late.

#include "sim/mcu/mcu_line.h"
#include "tests/drivers/contact/rig.h"
#include "tests/drivers/said.h"

namespace cellcal::drivers {
namespace {

class Delivery : public testing::Test {
 protected:
  Delivery() : mcu({}, kStart - milliseconds{7}), mcu_line(mcu), line(mcu_line) {}

  void run(Duration d) {
    for (const TimePoint end = clock.now() + d; clock.now() < end;) {
      clock.sleep_until(clock.now() + milliseconds{1});
      contact.run_until(clock.now());
    }
  }
  void get_ready() {
    contact.open();
    run(std::chrono::seconds{2});
    ASSERT_EQ(contact.status().link, ContactLink::kReady) << contact.status().words;
  }
  void arm(std::uint16_t id) {
    contact.arm(id, std::chrono::seconds{5});
    run(milliseconds{30});
    const auto answer = contact.poll_arm();
    ASSERT_TRUE(answer && answer->armed);
  }
  ContactSnapshot snapshot() { return contact.guard().snapshot(clock.now()); }

  VirtualClock clock;
  sim::Microcontroller mcu;
  sim::McuLine mcu_line;
  sim::LateLine line;
  ContactInline contact{{}, clock, line};
};

TEST_F(Delivery, BytesThatWereSentInTimeAndCameLateAreThisComputersFault) {
  get_ready();
  arm(1);
  line.hold(clock.now() + milliseconds{60});
  run(milliseconds{45});
  EXPECT_FALSE(snapshot().armed) << "25 ms without a heartbeat end the arming, whatever the reason";
  EXPECT_EQ(snapshot().last_end, ArmEnd::kSilence);
  EXPECT_EQ(snapshot().delivered_late_s, 0.0) << "not known yet";
  run(milliseconds{25});
  EXPECT_EQ(snapshot().last_end, ArmEnd::kDeliveredLate);
  EXPECT_NEAR(snapshot().delivered_late_s, 0.065, 0.006) << "nothing came for so long";
  EXPECT_EQ(contact.status().last_arm_end, ArmEnd::kDeliveredLate);
  const std::string words = said(contact.status().words);
  EXPECT_TRUE(contains(words, "this computer was busy, sensor data 6")) << words;
  arm(2);
  EXPECT_EQ(snapshot().delivered_late_s, 0.0) << "it is forgotten with the next arming";
}

TEST_F(Delivery, ASensorThatWasSilentIsNotTakenForALateComputer) {
  get_ready();
  arm(1);
  mcu.set_faults({.silent = true}, clock.now());
  run(milliseconds{60});
  mcu.set_faults({}, clock.now());
  run(milliseconds{200});
  EXPECT_EQ(snapshot().last_end, ArmEnd::kSilence);
  EXPECT_EQ(snapshot().delivered_late_s, 0.0);
  EXPECT_TRUE(contains(said(contact.status().words), "no heartbeat")) << contact.status().words;
}

TEST_F(Delivery, ALongSilenceIsNamedLateToo) {
  get_ready();
  line.hold(clock.now() + milliseconds{900});
  run(milliseconds{500});
  EXPECT_EQ(contact.status().fault, ContactFault::kSilent);
  EXPECT_FALSE(snapshot().alive);
  run(milliseconds{402});  // the answer to its HELLO came with the rest
  EXPECT_NE(contact.status().fault, ContactFault::kSilent);
  EXPECT_NEAR(snapshot().delivered_late_s, 0.85, 0.11);
  EXPECT_TRUE(contains(said(contact.status().words), "limit 300 ms")) << contact.status().words;
  run(std::chrono::seconds{3});
  EXPECT_EQ(contact.status().link, ContactLink::kReady) << contact.status().words;
  EXPECT_EQ(snapshot().delivered_late_s, 0.0);
}

TEST_F(Delivery, RegularHeartbeatsThatAreAllOldEndTheArming) {
  get_ready();
  arm(1);
  // Increases without a gap of 25 ms.
  for (int late = 1; late <= 40 && snapshot().armed; ++late) {
    line.delay(milliseconds{late});
    run(milliseconds{10});
  }
  EXPECT_FALSE(snapshot().armed) << "a trip would be as late";
  EXPECT_EQ(snapshot().last_end, ArmEnd::kDeliveredLate);
  EXPECT_GT(snapshot().delivered_late_s, 0.025);
}

TEST_F(Delivery, LatenessIsMeasuredByTheSensorsOwnStamps) {
  get_ready();
  EXPECT_LT(contact.status().quality.late_worst_s, 1e-3);
  line.hold(clock.now() + milliseconds{150});
  run(std::chrono::seconds{30});
  ContactQuality q = contact.status().quality;
  EXPECT_LT(q.late_p50_s, 1e-3);
  EXPECT_LT(q.late_max_s, 1e-3) << "256 heartbeats later";
  EXPECT_GT(q.late_worst_s, 0.05);
  contact.close();
  contact.open();
  EXPECT_EQ(contact.status().quality.late_worst_s, 0.0) << "of this opening";
}

/// Bytes without frames, as with a wrong baud rate.
class Garbage : public ByteLine {
 public:
  void write(std::span<const std::uint8_t>, TimePoint) override {}
  TimePoint next() const override { return due_; }
  void advance(TimePoint t) override { now_ = t; }
  std::size_t read(std::span<std::uint8_t> into, TimePoint& t) override {
    if (due_ > now_) return 0;
    t = due_;
    due_ += milliseconds{100};
    into[0] = 0xF8;
    into[1] = 0x00;
    into[2] = 0x1F;
    return 3;
  }

 private:
  TimePoint now_ = kStart, due_ = kStart + milliseconds{50};
};

TEST(ContactBaud, BytesWithoutAFrameAreAnotherBaudRateAndNotASilentSensor) {
  VirtualClock clock;
  Garbage line;
  ContactOptions options;
  options.baud = 250'000;
  ContactInline contact(options, clock, line);
  contact.open();
  for (int i = 0; i < 3000; ++i) {
    clock.sleep_until(clock.now() + milliseconds{1});
    contact.run_until(clock.now());
  }
  const ContactStatus status = contact.status();
  EXPECT_EQ(status.fault, ContactFault::kBaud);
  EXPECT_EQ(status.link, ContactLink::kFault);
  EXPECT_TRUE(contains(said(status.words), "no valid frame at 250000 baud")) << status.words;
  EXPECT_TRUE(contains(said(status.words), "Check [contact] device, set baud to the sensor's"))
      << status.words;
}

TEST(ContactBaud, NothingHeardIsNoBaudRate) {
  Rig rig;
  rig.mcu.set_faults({.silent = true}, rig.now());
  rig.contact.open();
  rig.run(std::chrono::seconds{4});
  EXPECT_EQ(rig.contact.status().fault, ContactFault::kNone);
  EXPECT_TRUE(contains(said(rig.contact.status().words), "nothing received"))
      << rig.contact.status().words;
}

}  // namespace
}  // namespace cellcal::drivers
