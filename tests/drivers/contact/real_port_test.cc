// The code path of real devices, through the unmodified libserialport, on a pseudo-terminal. Needs
// pty_shim preloaded (by ctest), which answers the two calls that a pseudo-terminal refuses.

#include <dlfcn.h>
#include <fcntl.h>
#include <gtest/gtest.h>
#include <linux/serial.h>
#include <linux/tty_flags.h>
#include <sys/ioctl.h>
#include <termios.h>
#include <unistd.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <boost/asio/steady_timer.hpp>
#include <cerrno>
#include <functional>
#include <optional>
#include <thread>

#include "baud_of.h"
#include "drivers/contact/port/port.h"
#include "drivers/contact/serial_contact.h"
#include "drivers/contact/wire/ctp_codec.h"
#include "pty_shim.h"
#include "robot_thread.h"
#include "sim/mcu/mcu_thread.h"

namespace cellcal::drivers {
namespace {

/// A function of pty_shim, available only if it is preloaded.
template <class Function>
Function shim(const char* name) {
  return reinterpret_cast<Function>(::dlsym(RTLD_DEFAULT, name));
}

struct Adapter {
  explicit Adapter(pty_shim_adapter_kind kind) { set(kind); }
  ~Adapter() { set(PTY_SHIM_NONE); }
  static void set(pty_shim_adapter_kind kind) {
    shim<void (*)(pty_shim_adapter_kind)>("pty_shim_adapter")(kind);
  }
};

class RealPort : public testing::Test {
 protected:
  void SetUp() override {
    const char* preloaded = std::getenv("LD_PRELOAD");
    if (preloaded == nullptr || std::string(preloaded).find("pty_shim") == std::string::npos) {
      GTEST_SKIP() << "pty_shim is not preloaded";
    }
  }
  sim::McuPty pty_{{}};
};

TEST_F(RealPort, OpensExclusiveRawNonBlockingAndClosedOnExec) {
  const auto port = open_real_port(pty_.path(), CTP_DEFAULT_BAUD);
  const int fd = port->fd();
  EXPECT_NE(::fcntl(fd, F_GETFD) & FD_CLOEXEC, 0);
  EXPECT_NE(::fcntl(fd, F_GETFL) & O_NONBLOCK, 0);
  int exclusive = 0;
  ASSERT_EQ(::ioctl(fd, TIOCGEXCL, &exclusive), 0);
  EXPECT_NE(exclusive, 0);
  termios tio{};
  ASSERT_EQ(::tcgetattr(fd, &tio), 0);
  EXPECT_EQ(tio.c_cc[VMIN], 1) << "libserialport leaves 0, which Asio reads as the end of file";
  EXPECT_EQ(tio.c_lflag & (ICANON | ECHO | ISIG), 0u);
  EXPECT_EQ(tio.c_iflag & (IXON | ICRNL), 0u);
  EXPECT_EQ(tio.c_cflag & HUPCL, 0u);
  EXPECT_EQ(tio.c_cflag & CSIZE, static_cast<tcflag_t>(CS8));
}

TEST_F(RealPort, KeepsEveryAllowedBaudRateThroughTheRawMode) {
  for (const int baud : {1'000'000, 250'000, 115'200}) {  // 250000 has no B constant
    EXPECT_EQ(baud_of(open_real_port(pty_.path(), baud)->fd()), baud);
  }
}

TEST_F(RealPort, IsRefusedTwiceAndFreeAfterClosing) {
  auto port = open_real_port(pty_.path(), CTP_DEFAULT_BAUD);
  EXPECT_THROW(open_real_port(pty_.path(), CTP_DEFAULT_BAUD), DriverError);
  port.reset();
  EXPECT_NO_THROW(open_real_port(pty_.path(), CTP_DEFAULT_BAUD));
}

TEST_F(RealPort, CarriesHelloAndIdentThroughAsio) {
  const auto port = open_real_port(pty_.path(), CTP_DEFAULT_BAUD);
  boost::asio::io_context io;
  boost::asio::posix::stream_descriptor stream(io, ::dup(port->fd()));
  boost::asio::steady_timer limit(io, std::chrono::seconds{10});
  limit.async_wait([&io](boost::system::error_code) { io.stop(); });
  const auto hello = ctp::build(ctp::Hello{1, 1, 4321}, 0);
  ASSERT_EQ(::write(port->fd(), hello.data.data(), hello.size), static_cast<ssize_t>(hello.size));

  ctp::FrameReader reader(ctp::Direction::kFromSensor);
  std::array<std::uint8_t, 256> bytes{};
  bool heard = false;
  boost::system::error_code failure;
  std::function<void()> read = [&] {
    stream.async_read_some(boost::asio::buffer(bytes), [&](boost::system::error_code error,
                                                           std::size_t n) {
      failure = error;
      for (std::size_t i = 0; i < n; ++i) {
        const ctp::Frame* f = reader.feed(bytes[i]);
        heard |= f != nullptr && f->type == CTP_IDENT && ctp::read<ctp::Ident>(*f).nonce == 4321;
      }
      if (heard || error) {
        io.stop();
      } else {
        read();
      }
    });
  };
  read();
  io.run();
  EXPECT_FALSE(failure) << failure.message();
  EXPECT_TRUE(heard);
}

TEST_F(RealPort, SetsTheLowLatencyFlagOfAnAdapterThatHasOne) {
  const Adapter adapter(PTY_SHIM_TAKES_LOW_LATENCY);
  EXPECT_EQ(open_real_port(pty_.path(), CTP_DEFAULT_BAUD)->warning(), "");
  EXPECT_NE(shim<int (*)()>("pty_shim_serial_flags")() & ASYNC_LOW_LATENCY, 0);
}

TEST_F(RealPort, WarnsOfALatencyTimerWithTheFixWhereTheFlagCannotBeSet) {
  const Adapter adapter(PTY_SHIM_REFUSES_LOW_LATENCY);
  const auto port = open_real_port(pty_.path(), CTP_DEFAULT_BAUD);
  EXPECT_NE(port->warning().find("16 ms"), std::string::npos) << port->warning();
  EXPECT_NE(port->warning().find("echo 1 > /sys/class/tty/"), std::string::npos);
}

TEST_F(RealPort, AnInterruptedReadIsNoLoss) {
  RobotSide robot({.device = pty_.path(), .always_libserialport = true});
  ASSERT_TRUE(robot.ready());
  shim<void (*)(int, int)>("pty_shim_fail_reads")(20, EINTR);
  EXPECT_TRUE(robot.stays_ready());
}

TEST_F(RealPort, HalfAFrameIsMadeUpForByTheProtocol) {
  RobotSide robot({.device = pty_.path(), .always_libserialport = true});
  ASSERT_TRUE(robot.ready());
  shim<void (*)(int)>("pty_shim_cut_writes")(3);
  EXPECT_TRUE(robot.arms());
}

TEST_F(RealPort, AnErrorOfTheDeviceIsALostPortThatIsOpenedAgainAndProvedAfresh) {
  RobotSide robot({.device = pty_.path(), .always_libserialport = true});
  ASSERT_TRUE(robot.ready());
  shim<void (*)(int, int)>("pty_shim_fail_reads")(1, EIO);
  ASSERT_TRUE(wait_for([&] { return !robot.status().self_test_ok; })) << "nothing is trusted";
  EXPECT_TRUE(robot.ready());
  EXPECT_TRUE(robot.status().self_test_ok);
  EXPECT_TRUE(robot.arms());
}

TEST_F(RealPort, SaysThatAPortIsMissing) {
  try {
    open_real_port("/dev/ttyCELLCAL9", CTP_DEFAULT_BAUD);
    FAIL() << "opened";
  } catch (const DriverError& e) {
    EXPECT_NE(std::string(e.what()).find("no such device"), std::string::npos) << e.what();
  }
}

}  // namespace
}  // namespace cellcal::drivers
