// Advice from checks, published to the controller: values, times, repetition; also with the emulated controller.

#include "daemon/controller/advice_publisher.h"

#include <gtest/gtest.h>

#include <atomic>

#include "drivers/kuka/krl/krl_files.h"
#include "sim/krc/eki_server.h"

namespace cellcal::daemon {
namespace {

using namespace std::chrono_literals;
using drivers::EkiFrameEnd;
using drivers::EkiFrameRequest;
using drivers::EkiFrameResult;

EkiFrameResult ended(EkiFrameEnd end,
                     drivers::EkiFrameTrouble trouble = drivers::EkiFrameTrouble::kNone) {
  EkiFrameResult result;
  result.end = end;
  result.trouble = trouble;
  return result;
}

struct Rig {
  AdvicePublisher::Parts parts() {
    return {[this] { return current; },
            [this]() -> AdvicePublisher::Send {
              if (!configured) return {};
              return [this](const EkiFrameRequest& request, const std::stop_token&) {
                sent.push_back(*request.values);
                EXPECT_EQ(request.kind, drivers::EkiFrameKind::kAdvice);
                EXPECT_EQ(request.number, 1);
                EkiFrameResult result = answer;
                if (result.end == EkiFrameEnd::kSet) result.new_values = request.values;
                return result;
              };
            },
            [this](const std::function<void()>& act) {
              if (!busy) act();
              return !busy;
            },
            [] { return std::string("2026-11-23T12:00:00Z"); }};
  }
  drivers::Duration poll(drivers::Duration later = 1s) { return publisher.poll(now += later); }

  PublishedAdvice current{Advice::kHolds, 753'456};
  bool configured = true, busy = false;
  EkiFrameResult answer = ended(EkiFrameEnd::kSet);
  std::vector<drivers::EkiFrameValues> sent;
  drivers::TimePoint now{24h};
  AdvicePublisher publisher{parts()};
};

TEST(AdvicePublisher, PublishesOnceAndThenWhatIsNew) {
  Rig rig;
  rig.poll();
  ASSERT_EQ(rig.sent.size(), 1U);
  EXPECT_EQ(rig.sent[0][0], 753'456.0);
  EXPECT_EQ(rig.sent[0][1], 1.0);
  EXPECT_EQ(rig.publisher.status().acknowledged, Advice::kHolds);
  EXPECT_EQ(rig.publisher.status().acknowledged_at, "2026-11-23T12:00:00Z");
  rig.poll(1h);
  EXPECT_EQ(rig.sent.size(), 1U);
  rig.current = {Advice::kRecalibrate, 0};
  rig.poll();
  ASSERT_EQ(rig.sent.size(), 2U);
  EXPECT_EQ(rig.sent[1][1], 5.0);
  EXPECT_EQ(rig.publisher.status().acknowledged, Advice::kRecalibrate);
}

TEST(AdvicePublisher, PublishesAgainTwiceADay) {
  Rig rig;
  rig.poll();
  rig.poll(11h);
  EXPECT_EQ(rig.sent.size(), 1U);
  rig.poll(1h);
  EXPECT_EQ(rig.sent.size(), 2U);
}

TEST(AdvicePublisher, PublishesNothingWhereItIsNotConfigured) {
  Rig rig;
  rig.configured = false;
  rig.poll();
  EXPECT_TRUE(rig.sent.empty());
  EXPECT_FALSE(rig.publisher.status().configured);
}

TEST(AdvicePublisher, WaitsForTheEndOfASessionWithoutCallingItATrouble) {
  Rig rig;
  rig.busy = true;
  EXPECT_LE(rig.poll(), 15s);
  EXPECT_TRUE(rig.sent.empty());
  EXPECT_EQ(rig.publisher.status().trouble, "");
  rig.busy = false;
  rig.poll();
  EXPECT_EQ(rig.sent.size(), 1U);
}

TEST(AdvicePublisher, TriesAgainAtGrowingPausesAndAtOnceWhereItIsAnother) {
  Rig rig;
  rig.answer = ended(EkiFrameEnd::kNotSent, drivers::EkiFrameTrouble::kNoConnection);
  rig.poll();
  EXPECT_NE(rig.publisher.status().trouble, "");
  rig.poll(30s);
  EXPECT_EQ(rig.sent.size(), 1U);
  rig.poll(31s);
  EXPECT_EQ(rig.sent.size(), 2U);
  rig.poll(61s);
  EXPECT_EQ(rig.sent.size(), 2U) << "two minutes by now";
  rig.poll(60s);
  EXPECT_EQ(rig.sent.size(), 3U);
  for (int i = 0; i < 600; ++i) rig.poll(60s);
  EXPECT_GE(rig.sent.size(), 3U + 9U) << "an hour at most";
  EXPECT_LE(rig.sent.size(), 3U + 14U);
  const std::size_t before = rig.sent.size();
  rig.current = {Advice::kCheckAgain, 0};
  rig.answer = ended(EkiFrameEnd::kSet);
  rig.poll();
  EXPECT_EQ(rig.sent.size(), before + 1);
  EXPECT_EQ(rig.publisher.status().trouble, "");
}

TEST(AdvicePublisher, WhatWasNotReadBackIsNotAcknowledged) {
  for (const EkiFrameEnd end : {EkiFrameEnd::kUnknown, EkiFrameEnd::kDiffers, EkiFrameEnd::kRefused,
                                EkiFrameEnd::kNotSent}) {
    Rig rig;
    rig.answer = ended(end);
    rig.poll();
    EXPECT_FALSE(rig.publisher.status().acknowledged) << static_cast<int>(end);
    EXPECT_NE(rig.publisher.status().trouble, "") << static_cast<int>(end);
  }
}

TEST(AdvicePublisher, AFailureBehindWhatWasAcknowledgedLeavesThatToBePublishedAgain) {
  Rig rig;
  rig.poll();
  rig.current = {Advice::kRecalibrate, 0};
  rig.answer = ended(EkiFrameEnd::kUnknown);
  rig.poll();
  rig.current = {Advice::kHolds, 753'456};
  rig.answer = ended(EkiFrameEnd::kSet);
  rig.poll();
  EXPECT_EQ(rig.sent.size(), 3U) << "whether the controller took the one before is not known";
}

TEST(AdvicePublisher, AJournalThatCannotBeReadIsATroubleOfItsOwn) {
  Rig rig;
  AdvicePublisher::Parts parts = rig.parts();
  parts.current = []() -> PublishedAdvice { throw std::runtime_error("journal is damaged"); };
  AdvicePublisher publisher(std::move(parts));
  publisher.poll(rig.now);
  EXPECT_EQ(publisher.status().trouble, "journal is damaged");
  EXPECT_TRUE(rig.sent.empty());
}

drivers::EkiFilesConfig with_advice() {
  drivers::EkiFilesConfig files;
  files.write_advice = true;
  return files;
}

struct Wire {
  Wire() {
    sim::EkiControllerConfig config;
    config.files = drivers::eki_files(with_advice());
    krc = std::make_unique<sim::EkiServer>(
        std::move(config), sim::EkiServerOptions{.address = "127.0.0.1", .port = 0});
    krc->start();
  }
  AdvicePublisher::Parts parts() {
    return {[this] {
              return PublishedAdvice{static_cast<Advice>(advice.load()), 0};
            },
            [this]() -> AdvicePublisher::Send {
              return [port = krc->port()](const EkiFrameRequest& request,
                                          const std::stop_token& stop) {
                return drivers::exchange_frame("127.0.0.1", port, request, {}, {2s, stop});
              };
            },
            [](const std::function<void()>& act) {
              act();
              return true;
            },
            [] { return std::string("2026-11-23T12:00:00Z"); }};
  }
  int on_controller() {
    int value = -1;
    krc->with([&](sim::EkiController& controller) { value = controller.advice(); });
    return value;
  }
  std::unique_ptr<sim::EkiServer> krc;
  std::atomic<int> advice{4};
};

bool comes_true(const std::function<bool()>& what) {
  for (int i = 0; i < 1000; ++i) {
    if (what()) return true;
    std::this_thread::sleep_for(10ms);
  }
  return false;
}

TEST(AdvicePublisherWire, TheControllerHasWhatWasPublishedAndWhatIsPublishedBehindAPoke) {
  Wire wire;
  AdvicePublisher publisher(wire.parts());
  publisher.start();
  EXPECT_TRUE(comes_true([&] { return wire.on_controller() == 4; }));
  wire.advice = 5;
  publisher.poke();
  EXPECT_TRUE(comes_true([&] { return wire.on_controller() == 5; }));
}

TEST(AdvicePublisherWire, AStopDoesNotWaitForAControllerThatSaysNothing) {
  Wire wire;
  wire.krc->with([](sim::EkiController& controller) { controller.mute(true); });
  std::atomic<bool> sending{false};
  AdvicePublisher::Parts parts = wire.parts();
  parts.alone = [&](const std::function<void()>& act) {
    sending = true;
    act();
    sending = false;
    return true;
  };
  AdvicePublisher publisher(std::move(parts));
  publisher.start();
  ASSERT_TRUE(comes_true([&] { return sending.load(); }));
  publisher.stop();
  EXPECT_FALSE(publisher.status().acknowledged);
  EXPECT_EQ(publisher.status().trouble, "") << "it ended, and nothing was found wrong";
}

}  // namespace
}  // namespace cellcal::daemon
