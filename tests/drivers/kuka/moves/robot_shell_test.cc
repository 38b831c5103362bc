// The infrastructure of a Robot on an I/O thread, with a core that obeys when the test lets it.

#include "drivers/kuka/moves/robot_shell.h"

#include <gtest/gtest.h>

namespace cellcal::drivers {
namespace {

struct ObedientCore {
  struct State {
    RobotLink link = RobotLink::kDown;
  };
  const State& core_state() const { return state; }
  void begin(const Move&) {}
  void stop() {}
  void rereference() { state.link = RobotLink::kNotReferenced; }
  std::optional<CoreResult> next_result() { return std::nullopt; }
  State state;
};

struct RobotShellOfACore : testing::Test {
  RobotShellOfACore() { open(); }
  void open() { shell.start(shell.open(core.state)); }
  void tick() {
    shell.obey(core);
    shell.publish(core);
  }
  void find_reference() {
    core.state.link = RobotLink::kReady;
    tick();
  }
  RobotLink link() const { return shell.state().link; }

  ObedientCore core;
  RobotShell<ObedientCore> shell;
};

TEST_F(RobotShellOfACore, IsNotReferencedFromTheRequestOnThoughTheCoreHasNotObeyedYet) {
  find_reference();
  ASSERT_EQ(link(), RobotLink::kReady);
  shell.rereference();
  EXPECT_EQ(link(), RobotLink::kNotReferenced);
  shell.publish(core);
  EXPECT_EQ(link(), RobotLink::kNotReferenced) << "a tick that began before the request";
  shell.rereference();
  tick();
  EXPECT_EQ(link(), RobotLink::kNotReferenced);
  find_reference();
  EXPECT_EQ(link(), RobotLink::kReady);
}

TEST_F(RobotShellOfACore, ClaimsNoReferenceOfALinkThatIsDown) {
  shell.rereference();
  EXPECT_EQ(link(), RobotLink::kDown);
}

TEST_F(RobotShellOfACore, ForgetsRequestsOfAnEarlierOpening) {
  find_reference();
  shell.rereference();
  shell.closed();
  shell.rereference();
  open();
  find_reference();
  EXPECT_EQ(link(), RobotLink::kReady);
}

}  // namespace
}  // namespace cellcal::drivers
