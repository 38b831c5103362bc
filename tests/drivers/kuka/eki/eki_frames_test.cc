// A frame read or set over EKI: with the emulated controller in virtual time, on real sockets with it, and with
// faulty peers.

#include <gtest/gtest.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/write.hpp>
#include <cmath>
#include <functional>
#include <thread>

#include "drivers/kuka/eki/eki_aside.h"
#include "drivers/kuka/krl/krl_files.h"
#include "sim/krc/eki_server.h"

namespace cellcal::drivers {
namespace {

using namespace std::chrono_literals;

constexpr EkiFrameValues kOld{59.9, 50.5, 410.3, 38.84, 3.59, 0.0};
constexpr EkiFrameValues kNew{60.1234, 50.2, 410.4, 38.84, 3.59001, -0.0005};

sim::EkiControllerConfig with_frames(bool write_frames = true, bool write_advice = true) {
  EkiFilesConfig files;
  files.write_frames = write_frames;
  files.write_advice = write_advice;
  sim::EkiControllerConfig config;
  config.files = eki_files(files);
  config.tool_data[2] = kOld;
  return config;
}

EkiFrameRequest set_tool(int number = 3) { return {EkiFrameKind::kTool, number, kNew}; }

/// One exchange in virtual time.
struct Rig {
  explicit Rig(EkiFrameRequest wanted, sim::EkiControllerConfig config = with_frames())
      : krc(std::move(config)), request(std::move(wanted)) {
    krc.start_program();
    cycle();
    EXPECT_TRUE(krc.connect());
    exchange.emplace(request, 4711, now);
  }

  void cycle() {
    now += krc.cycle();
    krc.tick(now);
    if (!exchange) return;
    if (cable) exchange->on_bytes(mangle(krc.drain_output()), now);
    exchange->on_tick(now);
    const std::string out = exchange->drain_output();
    written += out;
    if (cable) krc.receive(mangle_telegram(out));
    if (each) each();
  }
  EkiFrameResult run() {
    for (int i = 0; i < 3000 && !exchange->result(); ++i) cycle();
    EXPECT_TRUE(exchange->result().has_value());
    return exchange->result().value_or(EkiFrameResult{});
  }
  bool sent() const { return !written.empty(); }

  TimePoint now{1h};
  sim::EkiController krc;
  EkiFrameRequest request;
  std::optional<EkiFrameExchange> exchange;
  std::string written;
  bool cable = true;
  std::function<std::string(std::string)> mangle = [](std::string text) { return text; };
  std::function<std::string(std::string)> mangle_telegram = mangle;
  std::function<void()> each;
};

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  for (std::size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size())
    text.replace(at, from.size(), to);
  return text;
}

TEST(EkiFrames, ASetFrameIsReadBackAndTheOldOneComesWithIt) {
  Rig rig(set_tool());
  const EkiFrameResult result = rig.run();
  EXPECT_EQ(result.end, EkiFrameEnd::kSet);
  ASSERT_TRUE(result.old_values && result.new_values);
  EXPECT_TRUE(same_frame(kOld, *result.old_values));
  EXPECT_TRUE(same_frame(kNew, *result.new_values));
  EXPECT_TRUE(same_frame(kNew, rig.krc.frame(EkiFrameKind::kTool, 3)));
  EXPECT_EQ(rig.krc.frames_set(), 1U);
  EXPECT_EQ(rig.krc.moves(), 0U) << "nothing moves by it";
  EXPECT_EQ(rig.krc.session(), 0U) << "nobody is obeyed by it";
}

TEST(EkiFrames, AReadSetsNothing) {
  Rig rig({EkiFrameKind::kTool, 3, std::nullopt});
  const EkiFrameResult result = rig.run();
  EXPECT_EQ(result.end, EkiFrameEnd::kRead);
  ASSERT_TRUE(result.new_values);
  EXPECT_TRUE(same_frame(kOld, *result.new_values));
  EXPECT_EQ(rig.krc.frames_set(), 0U);
}

TEST(EkiFrames, ABaseIsNoTool) {
  Rig rig({EkiFrameKind::kBase, 32, kNew});
  EXPECT_EQ(rig.run().end, EkiFrameEnd::kSet);
  EXPECT_TRUE(same_frame(kNew, rig.krc.frame(EkiFrameKind::kBase, 32)));
  EXPECT_TRUE(same_frame(kOld, rig.krc.frame(EkiFrameKind::kTool, 3)));
}

EkiFrameRequest set_advice(double code, double until = 753'456.0) {
  return {EkiFrameKind::kAdvice, 1, EkiFrameValues{until, code}};
}

TEST(EkiFrames, TheAdviceIsSetAndReadBackWhileAnotherProgramMovesTheArm) {
  Rig rig(set_advice(4));
  rig.krc.start_other_program();
  const EkiFrameResult result = rig.run();
  EXPECT_EQ(result.end, EkiFrameEnd::kSet);
  EXPECT_EQ(rig.krc.advice(), 4);
  EXPECT_EQ(rig.krc.advice_until(), 753'456);
  EXPECT_EQ(rig.krc.frames_set(), 0U);
  EXPECT_EQ(rig.krc.session(), 0U) << "nobody is obeyed by it";
}

TEST(EkiFrames, AnAdviceThatIsNoneIsRefusedByTheController) {
  for (const double code : {-1.0, 6.0}) {
    Rig rig(set_advice(code));
    const EkiFrameResult result = rig.run();
    EXPECT_EQ(result.end, EkiFrameEnd::kRefused) << code;
    EXPECT_EQ(result.refusal, EkiFrameDone::kNoSuchNumber) << code;
    EXPECT_EQ(rig.krc.advice(), 0);
  }
}

TEST(EkiFrames, AControllerWhoseFilesDoNotHoldTheAdviceRefusesIt) {
  Rig rig(set_advice(4), with_frames(true, false));
  EXPECT_EQ(rig.run().refusal, EkiFrameDone::kNoSuchNumber);
}

TEST(EkiFrames, AControllerWhoseFilesHoldTheAdviceAloneSetsNoFrame) {
  Rig rig(set_tool(), with_frames(false, true));
  EXPECT_EQ(rig.run().refusal, EkiFrameDone::kNoSuchNumber);
  EXPECT_EQ(rig.krc.frames_set(), 0U);
}

TEST(EkiFrames, ANumberThatTheControllerLacksIsRefusedByIt) {
  for (const int number : {0, 17, 128}) {
    Rig rig(set_tool(number));
    const EkiFrameResult result = rig.run();
    EXPECT_EQ(result.end, EkiFrameEnd::kRefused) << number;
    EXPECT_EQ(result.refusal, EkiFrameDone::kNoSuchNumber) << number;
    EXPECT_EQ(rig.krc.frames_set(), 0U);
  }
}

TEST(EkiFrames, WhileAnotherProgramRunsTheControllerRefuses) {
  Rig rig(set_tool());
  rig.krc.start_other_program();
  const EkiFrameResult result = rig.run();
  EXPECT_EQ(result.end, EkiFrameEnd::kRefused);
  EXPECT_EQ(result.refusal, EkiFrameDone::kOtherProgram);
  EXPECT_EQ(rig.krc.frames_set(), 0U);
}

/// Another client connects and sends hello in between.
TEST(EkiFrames, WhileSomebodyIsObeyedTheControllerRefuses) {
  Rig rig(set_tool());
  EkiCommand hello;
  hello.session = 77;
  hello.seq = 1;
  hello.type = EkiType::kHello;
  hello.target_deg.assign(6, 0.0);
  std::array<char, kEkiTelegram> buffer{};
  rig.each = [&] {
    if (rig.sent() && rig.krc.session() == 0) rig.krc.receive(format_command(hello, buffer));
  };
  const EkiFrameResult result = rig.run();
  EXPECT_EQ(result.end, EkiFrameEnd::kRefused);
  EXPECT_EQ(result.refusal, EkiFrameDone::kInSession);
  EXPECT_EQ(rig.krc.frames_set(), 0U);
}

TEST(EkiFrames, NothingIsSentToAControllerThatObeysSomebody) {
  Rig rig(set_tool());
  rig.mangle = [](std::string text) { return replaced(text, "Session=\"0\"", "Session=\"5\""); };
  const EkiFrameResult result = rig.run();
  EXPECT_EQ(result.end, EkiFrameEnd::kNotSent);
  EXPECT_EQ(result.trouble, EkiFrameTrouble::kInSession);
  EXPECT_FALSE(rig.sent());
}

TEST(EkiFrames, NothingIsSentWhileTheArmIsJogged) {
  Rig rig(set_tool());
  double deg = 0.0;
  rig.each = [&] { rig.krc.place({1e-4 * (deg += 2.0), -1.57, 1.57, 0.0, 1.57, 0.0}); };
  const EkiFrameResult result = rig.run();
  EXPECT_EQ(result.end, EkiFrameEnd::kNotSent);
  EXPECT_EQ(result.trouble, EkiFrameTrouble::kMoves);
  EXPECT_FALSE(rig.sent());
}

TEST(EkiFrames, StatesThatCeaseAtOnceAreNoArmThatMoves) {
  Rig rig(set_tool());
  int states = 0;
  rig.mangle = [&](std::string text) {
    if (!text.empty()) ++states;
    return states > 5 ? std::string() : text;
  };
  const EkiFrameResult result = rig.run();
  EXPECT_EQ(result.end, EkiFrameEnd::kNotSent);
  EXPECT_EQ(result.trouble, EkiFrameTrouble::kNoState);
  EXPECT_FALSE(rig.sent());
}

TEST(EkiFrames, ValuesThatFitIntoNoTelegramAreNotSent) {
  for (const double wrong : {std::nan(""), HUGE_VAL, 1e300}) {
    Rig rig({EkiFrameKind::kTool, 3, EkiFrameValues{wrong, wrong, wrong, wrong, wrong, wrong}});
    const EkiFrameResult result = rig.run();
    EXPECT_EQ(result.end, EkiFrameEnd::kNotSent) << wrong;
    EXPECT_EQ(result.trouble, EkiFrameTrouble::kNoTelegram) << wrong;
    EXPECT_FALSE(rig.sent());
  }
}

TEST(EkiFrames, ASetBehindAReadGoesOutOnTheSameConnection) {
  Rig rig({EkiFrameKind::kTool, 3, std::nullopt});
  ASSERT_EQ(rig.run().end, EkiFrameEnd::kRead);
  rig.exchange->set(kNew, 4712, rig.now);
  EXPECT_EQ(rig.run().end, EkiFrameEnd::kSet);
  EXPECT_EQ(rig.krc.frames_set(), 1U);
  EXPECT_TRUE(same_frame(kNew, rig.krc.frame(EkiFrameKind::kTool, 3)));
}

TEST(EkiFrames, AnArmThatIsJoggedBehindTheTelegramIsRefusedByTheController) {
  Rig rig(set_tool());
  double deg = 0.0;
  rig.each = [&] {
    if (rig.sent()) rig.krc.place({1e-4 * (deg += 2.0), -1.57, 1.57, 0.0, 1.57, 0.0});
  };
  const EkiFrameResult result = rig.run();
  EXPECT_EQ(result.end, EkiFrameEnd::kRefused);
  EXPECT_EQ(result.refusal, EkiFrameDone::kMoves);
  EXPECT_EQ(rig.krc.frames_set(), 0U);
}

TEST(EkiFrames, AControllerWithoutFramesIsAskedNothing) {
  Rig rig(set_tool(), with_frames(false, false));
  const EkiFrameResult result = rig.run();
  EXPECT_EQ(result.end, EkiFrameEnd::kNotSent);
  EXPECT_EQ(result.trouble, EkiFrameTrouble::kTooOld);
  EXPECT_FALSE(rig.sent());
}

TEST(EkiFrames, ALostAnswerIsUnknownAndNoSuccess) {
  Rig rig(set_tool());
  // Set, but the answer is lost.
  rig.mangle = [&](std::string text) { return rig.krc.frames_set() > 0 ? std::string() : text; };
  const EkiFrameResult result = rig.run();
  EXPECT_EQ(rig.krc.frames_set(), 1U);
  EXPECT_EQ(result.end, EkiFrameEnd::kUnknown);
  EXPECT_EQ(result.trouble, EkiFrameTrouble::kNoAnswer);
  EXPECT_FALSE(result.new_values);
}

TEST(EkiFrames, AReadWhoseAnswerIsLostHasChangedNothing) {
  Rig rig({EkiFrameKind::kTool, 3, std::nullopt});
  rig.each = [&] { rig.cable = !rig.sent(); };
  EXPECT_EQ(rig.run().end, EkiFrameEnd::kNotSent);
}

TEST(EkiFrames, AConnectionThatEndsBeforeTheFrameWasSetLeavesItAsItWas) {
  Rig rig(set_tool());
  int cycles = 0;
  rig.each = [&] {
    if (!rig.sent() || ++cycles != 20) return;
    rig.krc.disconnect();
    rig.exchange->on_closed();
  };
  const EkiFrameResult result = rig.run();
  EXPECT_EQ(result.end, EkiFrameEnd::kUnknown);
  EXPECT_EQ(result.trouble, EkiFrameTrouble::kClosed);
  for (int i = 0; i < 500; ++i) rig.cycle();
  EXPECT_EQ(rig.krc.frames_set(), 0U) << "what a client that is gone asked for";
  EXPECT_TRUE(same_frame(kOld, rig.krc.frame(EkiFrameKind::kTool, 3)));
}

/// Do of a state before any telegram is 0, which a complete answer must not have.
TEST(EkiFrames, ATelegramThatLacksAnElementIsRefusedByTheController) {
  for (const char* lost : {" C=\"-0.00050\"", " X=\"60.1234\"", " Do=\"2\"", " Kind=\"1\""}) {
    Rig rig(set_tool());
    rig.mangle_telegram = [&](std::string text) { return replaced(std::move(text), lost, ""); };
    const EkiFrameResult result = rig.run();
    EXPECT_EQ(result.end, EkiFrameEnd::kRefused) << lost;
    EXPECT_EQ(result.refusal, EkiFrameDone::kIncomplete) << lost;
    EXPECT_EQ(rig.krc.frames_set(), 0U) << lost;
    // Its remainder is discarded: the next one is complete.
    rig.mangle_telegram = [](std::string text) { return text; };
    rig.exchange->set(kNew, 4712, rig.now);
    EXPECT_EQ(rig.run().end, EkiFrameEnd::kSet) << lost;
    EXPECT_TRUE(same_frame(kNew, rig.krc.frame(EkiFrameKind::kTool, 3))) << lost;
  }
}

/// Plausibility checks of an answer, with one damage at a time.
TEST(EkiFrames, AnAnswerThatCannotBeBelievedIsUnknown) {
  const struct {
    const char *from, *to;
    EkiFrameTrouble why;
  } kDamages[] = {
      {"Number=\"3\"", "Number=\"4\"", EkiFrameTrouble::kOtherFrame},
      {"Kind=\"1\"", "Kind=\"2\"", EkiFrameTrouble::kOtherFrame},
      {"Do=\"2\"", "Do=\"1\"", EkiFrameTrouble::kOtherFrame},
      {"Ask=\"4711\"", "Ask=\"4712\"", EkiFrameTrouble::kNoAnswer},
      {"Done=\"1\"", "Done=\"9\"", EkiFrameTrouble::kNoAnswer},
      {"Done=\"1\"", "Done=\"1\" Done=\"1\"", EkiFrameTrouble::kNoAnswer},
      {"<FrameNew X=", "<FrameNew Y=", EkiFrameTrouble::kNoAnswer},
      {"<FrameNew X=\"60", "<FrameNew X=\"nan\" Q=\"60", EkiFrameTrouble::kNoAnswer},
      {"<FrameNew X=\"60", "<FrameNew X=\"1e999\" Q=\"60", EkiFrameTrouble::kNoAnswer},
      {"<FrameOld", "<Frameold/><FrameOld", EkiFrameTrouble::kNoAnswer},
      {"</RobotState>", "<Frame/></RobotState>", EkiFrameTrouble::kNoAnswer},
      {"<FrameNew X=", "<FrameNew X=<", EkiFrameTrouble::kNoAnswer},
  };
  for (const auto& damage : kDamages) {
    Rig rig(set_tool());
    rig.mangle = [&](std::string text) {
      return rig.sent() ? replaced(std::move(text), damage.from, damage.to) : text;
    };
    const EkiFrameResult result = rig.run();
    EXPECT_EQ(result.end, EkiFrameEnd::kUnknown) << damage.to;
    EXPECT_EQ(result.trouble, damage.why) << damage.to;
  }
}

TEST(EkiFrames, OneDamagedStateIsNotTheLast) {
  Rig rig(set_tool());
  int damaged = 0;
  rig.mangle = [&](std::string text) {
    if (rig.krc.frames_set() > 0 && !text.empty() && damaged++ < 3)
      return text.substr(0, text.size() / 2) + "</RobotState>";
    return text;
  };
  EXPECT_EQ(rig.run().end, EkiFrameEnd::kSet);
  EXPECT_GT(damaged, 3);
}

TEST(EkiFrames, AStreamWithoutAnEndEndsTheExchange) {
  Rig rig(set_tool());
  rig.mangle = [&](std::string text) {
    return rig.sent() ? "<RobotState " + std::string(9000, 'x') : text;
  };
  const EkiFrameResult result = rig.run();
  EXPECT_EQ(result.end, EkiFrameEnd::kUnknown);
  EXPECT_EQ(result.trouble, EkiFrameTrouble::kNotAStream);
}

TEST(EkiFrames, AnotherNumberReadBackIsADifferenceAndNoSuccess) {
  Rig rig(set_tool());
  rig.mangle = [](std::string text) { return replaced(text, "X=\"60.1234", "X=\"60.1244"); };
  const EkiFrameResult result = rig.run();
  EXPECT_EQ(result.end, EkiFrameEnd::kDiffers);
  ASSERT_TRUE(result.new_values);
  EXPECT_NEAR((*result.new_values)[0], 60.1244, 1e-5);
}

TEST(EkiFrames, WhatA32BitRealHoldsIsTheSame) {
  EXPECT_TRUE(same_frame({1234.56789}, {static_cast<double>(1234.5679F)}));
  EXPECT_FALSE(same_frame({1234.5678}, {1234.5682}));
  EXPECT_FALSE(same_frame({0, 0, 0, 10.0}, {0, 0, 0, 10.0001}));
  EXPECT_FALSE(same_frame({0.0}, {std::nan("")}));
}

TEST(EkiFrameSockets, SetAFrameOfTheEmulatedController) {
  sim::EkiServer krc(with_frames(), {.address = "127.0.0.1", .port = 0});
  krc.start();
  const EkiFrameResult result = exchange_frame("127.0.0.1", krc.port(), set_tool());
  EXPECT_EQ(result.end, EkiFrameEnd::kSet) << result.detail;
  krc.with([](sim::EkiController& controller) {
    EXPECT_TRUE(same_frame(kNew, controller.frame(EkiFrameKind::kTool, 3)));
  });
}

TEST(EkiFrameSockets, AnswerOneExchangeRightBehindAnother) {
  sim::EkiServer krc(with_frames(), {.address = "127.0.0.1", .port = 0});
  krc.start();
  const EkiFrameRequest read{EkiFrameKind::kTool, 3, std::nullopt};
  const EkiFrameRequest old{EkiFrameKind::kTool, 3, kOld};
  EXPECT_EQ(exchange_frame("127.0.0.1", krc.port(), read).end, EkiFrameEnd::kRead);
  EXPECT_EQ(exchange_frame("127.0.0.1", krc.port(), set_tool()).end, EkiFrameEnd::kSet);
  EXPECT_EQ(exchange_frame("127.0.0.1", krc.port(), read).end, EkiFrameEnd::kRead);
  EXPECT_EQ(exchange_frame("127.0.0.1", krc.port(), old).end, EkiFrameEnd::kSet);
  krc.with([](sim::EkiController& controller) {
    EXPECT_EQ(controller.frames_set(), 2U);
    EXPECT_TRUE(same_frame(kOld, controller.frame(EkiFrameKind::kTool, 3)));
  });
}

/// A peer on a real socket that sends states, and `behind` after a request; then it disconnects.
class Peer {
 public:
  explicit Peer(std::string behind)
      : acceptor_(context_, {boost::asio::ip::make_address("127.0.0.1"), 0}),
        thread_([this, behind = std::move(behind)] { serve(behind); }) {}
  ~Peer() { thread_.join(); }
  std::uint16_t port() const { return acceptor_.local_endpoint().port(); }

 private:
  static std::string state() {
    return "<RobotState Session=\"0\" Heard=\"0\"><Axis A1=\"0.000\" A2=\"1.000\"/><Move Id=\"0\" "
           "State=\"0\" Outcome=\"0\"/><Status Ready=\"1\"/><Frame Ask=\"0\"/></RobotState>";
  }
  void serve(const std::string& behind) {
    boost::asio::ip::tcp::socket socket(context_);
    acceptor_.accept(socket);
    boost::system::error_code error;
    for (int i = 0; i < 500 && socket.available(error) == 0 && !error; ++i) {
      write(socket, boost::asio::buffer(state()), error);
      std::this_thread::sleep_for(10ms);
    }
    write(socket, boost::asio::buffer(behind), error);
  }

  boost::asio::io_context context_;
  boost::asio::ip::tcp::acceptor acceptor_;
  std::thread thread_;
};

TEST(EkiFrameSockets, APeerThatHangsUpBehindTheTelegramLeavesItUnknown) {
  for (const char* behind : {"", "<RobotState Session=\"0\" Heard=\"0\"><Frame Ask=\"1\" Do",
                             "\x00\xff<<<</RobotState>"}) {
    const Peer peer(behind);
    const EkiFrameResult result = exchange_frame("127.0.0.1", peer.port(), set_tool());
    EXPECT_EQ(result.end, EkiFrameEnd::kUnknown) << behind;
    EXPECT_EQ(result.trouble, EkiFrameTrouble::kClosed) << behind;
  }
}

}  // namespace
}  // namespace cellcal::drivers
