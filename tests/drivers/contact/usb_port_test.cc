// The port through libusb, on an emulated usbfs. Needs libumockdev-preload preloaded (ctest does
// that).

#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "drivers/contact/port/port.h"
#include "robot_thread.h"
#include "sim/mcu/mcu_thread.h"
#include "usb_adapter.h"

namespace cellcal::drivers {
namespace {

bool preloaded() {
  const char* libraries = std::getenv("LD_PRELOAD");
  return libraries != nullptr && std::string(libraries).find("umockdev") != std::string::npos;
}

class UsbPort : public testing::TestWithParam<UsbAdapterKind> {
 protected:
  void SetUp() override {
    if (!preloaded()) GTEST_SKIP() << "libumockdev-preload is not preloaded";
    adapter_ = std::make_unique<UsbAdapter>(GetParam(), pty_.path());
  }
  sim::McuPty pty_{{}};
  std::unique_ptr<UsbAdapter> adapter_;
};

INSTANTIATE_TEST_SUITE_P(Adapters, UsbPort,
                         testing::Values(UsbAdapterKind::kCdcAcm, UsbAdapterKind::kFtdi),
                         [](const auto& kind) {
                           return kind.param == UsbAdapterKind::kFtdi ? "Ftdi" : "CdcAcm";
                         });

TEST_P(UsbPort, CarriesTheProtocolUntilTheSensorIsReadyAndArms) {
  RobotSide robot({adapter_->path()});
  ASSERT_TRUE(robot.ready()) << robot.status().warning;
  EXPECT_TRUE(robot.stays_ready());
  EXPECT_TRUE(robot.arms());
}

TEST_P(UsbPort, TakesTheInterfacesAndGivesThemBackToTheKernel) {
  auto port = open_port({adapter_->path()});
  EXPECT_EQ(adapter_->claimed(), GetParam() == UsbAdapterKind::kFtdi ? 1u : 2u);
  EXPECT_EQ(adapter_->given_back(), 0u);
  port.reset();
  EXPECT_EQ(adapter_->claimed(), 0u);
  EXPECT_GT(adapter_->given_back(), 0u);
}

TEST_P(UsbPort, IsRefusedTwiceAndFreeAfterClosing) {
  auto port = open_port({adapter_->path()});
  EXPECT_THROW(open_port({adapter_->path()}), DriverError);
  port.reset();
  EXPECT_NO_THROW(open_port({adapter_->path()}));
}

TEST_P(UsbPort, ALostDeviceEndsTheLinkAndIsOpenedAgain) {
  RobotSide robot({adapter_->path()});
  ASSERT_TRUE(robot.ready());
  adapter_->plug(false);
  ASSERT_TRUE(wait_for([&] { return robot.status().link != ContactLink::kReady; }));
  adapter_->plug(true);
  EXPECT_TRUE(robot.ready());
}

TEST_P(UsbPort, FramesThatTheDeviceDoesNotTakeAreLostAndTheNextGoOut) {
  RobotSide robot({adapter_->path()});
  ASSERT_TRUE(robot.ready());
  adapter_->stall_output(true);
  EXPECT_TRUE(robot.stays_ready()) << "heartbeats go on";
  adapter_->stall_output(false);
  EXPECT_TRUE(robot.arms());
}

TEST_P(UsbPort, ClosesWithinASecondWhileTheDeviceTakesNothing) {
  auto port = open_port({adapter_->path()});
  adapter_->stall_output(true);
  ASSERT_EQ(::write(port->fd(), "x", 1), 1);
  port.reset();
  EXPECT_EQ(adapter_->claimed(), 0u);
}

TEST(UsbRequests, CdcAcmGetsItsLineCodingAndControlLines) {
  if (!preloaded()) GTEST_SKIP() << "libumockdev-preload is not preloaded";
  const sim::McuPty pty{{}};
  UsbAdapter adapter(UsbAdapterKind::kCdcAcm, pty.path());
  open_port({adapter.path(), 250'000});
  const std::vector<UsbRequest> requests = adapter.requests();
  ASSERT_EQ(requests.size(), 2u);
  EXPECT_EQ(requests[0].type, 0x21);
  EXPECT_EQ(requests[0].number, 0x20);
  EXPECT_EQ(requests[0].data, (std::vector<std::uint8_t>{0x90, 0xD0, 0x03, 0x00, 0, 0, 8}));
  EXPECT_EQ(requests[1].number, 0x22);
  EXPECT_EQ(requests[1].value, 3);
}

TEST(UsbRequests, FtdiGetsATimerOfOneMillisecondAndItsDivisor) {
  if (!preloaded()) GTEST_SKIP() << "libumockdev-preload is not preloaded";
  for (const auto& [baud, divisor] : {std::pair{1'000'000, 3}, {250'000, 12}, {115'200, 26}}) {
    const sim::McuPty pty{{}};
    UsbAdapter adapter(UsbAdapterKind::kFtdi, pty.path());
    open_port({adapter.path(), baud});
    std::map<int, int> values;
    for (const UsbRequest& one : adapter.requests()) {
      EXPECT_EQ(one.type, 0x40);
      values[one.number] = one.value;
    }
    EXPECT_EQ(values[9], 1);
    EXPECT_EQ(values[3], divisor);
    EXPECT_EQ(values[4], 8);
    EXPECT_EQ(values[1], 0x0303);
  }
}

TEST(UsbRequests, AnotherKindOfAdapterIsRefusedWithTheWayOut) {
  if (!preloaded()) GTEST_SKIP() << "libumockdev-preload is not preloaded";
  const sim::McuPty pty{{}};
  UsbAdapter adapter(UsbAdapterKind::kOther, pty.path());
  try {
    open_port({adapter.path()});
    FAIL() << "opened";
  } catch (const DriverError& error) {
    EXPECT_NE(std::string(error.what()).find("/dev/cellcal-contact"), std::string::npos)
        << error.what();
  }
  EXPECT_EQ(adapter.claimed(), 0u);
}

}  // namespace
}  // namespace cellcal::drivers
