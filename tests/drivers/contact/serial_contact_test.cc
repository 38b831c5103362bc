// SerialContact over real pseudo-terminals. Waits have generous limits, nothing is timed.

#include "drivers/contact/serial_contact.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <pty.h>
#include <unistd.h>

#include <cerrno>
#include <filesystem>
#include <fstream>
#include <future>
#include <memory>
#include <optional>

#include "drivers/contact/port/port.h"
#include "sim/mcu/mcu_thread.h"
#include "tests/drivers/contact/rig.h"
#include "tests/drivers/contact/robot_thread.h"
#include "tests/drivers/said.h"

namespace cellcal::drivers {
namespace {

std::string open_error(const std::string& device) {
  boost::asio::io_context io;
  SerialContact contact(io, options_for(device));
  io.stop();
  try {
    contact.open();
  } catch (const DriverError& e) {
    return e.what();
  }
  return "no error";
}

TEST(PortWithoutPermission, NeverAdvisesToJoinTheGroupRoot) {
  const std::string device = ::testing::TempDir() + "port_of_root";
  std::ofstream(device) << "";
  if (::chown(device.c_str(), 0, 0) != 0) GTEST_SKIP() << "not root here";
  const std::string words = cannot_open(device, EACCES);
  EXPECT_EQ(words.find("usermod"), std::string::npos) << words;
  EXPECT_NE(words.find("70-cellcal.rules"), std::string::npos) << words;
  std::filesystem::remove(device);
}

TEST(SerialContact, SaysWhichDeviceIsMissingAndWhichPortsThereAre) {
  const std::string words = open_error("/dev/ttyCELLCAL9");
  EXPECT_TRUE(contains(words, "/dev/ttyCELLCAL9: no such device")) << words;
  EXPECT_TRUE(contains(words, "Plug the sensor in")) << words;
  EXPECT_TRUE(contains(words, "ports found: ")) << words;
}

TEST(SerialContact, SaysThatAFileOrAnotherDeviceIsNotASerialPort) {
  for (const std::string device : {"/etc/hostname", "/dev/null"})
    EXPECT_TRUE(contains(open_error(device),
                         device + ": not a serial port, or nothing connected to it. Name the "
                                  "sensor's port as device under [contact] (ports found: "))
        << open_error(device);
  for (const int error : {ENOENT, ENXIO, ENODEV, ENOTTY})
    EXPECT_TRUE(contains(cannot_open("/dev/tty", error), "not a serial port")) << error;
}

TEST(SerialContact, RefusesASenselessBaudRate) {
  EXPECT_THROW(open_port({"/dev/null", 7}), ConfigError);
}

TEST(SerialContact, SaysWhoUsesAPort) {
  sim::McuPty pty({});
  const auto first = open_port({pty.path(), CTP_DEFAULT_BAUD});
  const std::string words = open_error(pty.path());
  EXPECT_TRUE(contains(words, "in use by process " + std::to_string(::getpid()))) << words;
}

TEST(SerialContact, APortCanBeOpenedAgainOnceItIsClosed) {
  sim::McuPty pty({});
  for (int i = 0; i < 3; ++i) {
    EXPECT_NO_THROW(open_port({pty.path(), CTP_DEFAULT_BAUD}).reset());
  }
}

TEST(SerialContact, FollowsSymlinks) {
  const std::string link = ::testing::TempDir() + "contact-link-" + std::to_string(::getpid());
  {
    sim::McuPty pty({{}, link});
    const auto port = open_port({link, CTP_DEFAULT_BAUD});
    EXPECT_EQ(port->path(), pty.path());
  }
  EXPECT_FALSE(std::filesystem::exists(std::filesystem::symlink_status(link)));
}

TEST(SerialContact, LockNamesAreThoseOfOtherPrograms) {
  EXPECT_EQ(lock_name("/dev/ttyUSB0"), "LCK..ttyUSB0");
  EXPECT_EQ(lock_name("/dev/pts/3"), "LCK..pts-3");
}

TEST(SerialContact, IdentifiesArmsAndReportsATouchWithItsTime) {
  sim::McuPty pty({});
  RobotThread robot(options_for(pty.path()));
  robot.contact.open();
  expect_touch_with_its_time(robot, pty);
}

TEST(SerialContact, APassFromBeforeIsNoAnswerToASelfTest) {
  sim::McuPty pty({});
  RobotThread robot(options_for(pty.path()));
  robot.contact.open();
  ASSERT_TRUE(robot.ready()) << robot.contact.status().words;
  ASSERT_TRUE(robot.contact.status().self_test_ok);
  std::promise<void> go = robot.hold();
  robot.contact.self_test();
  const bool ok_meanwhile = robot.contact.status().self_test_ok;
  go.set_value();
  EXPECT_FALSE(ok_meanwhile);
  EXPECT_TRUE(wait_for([&] { return robot.contact.status().self_test_ok; }))
      << robot.contact.status().words;
}

TEST(SerialContact, ArmingWithoutAPortIsRefusedWithTheReason) {
  boost::asio::io_context io;
  SerialContact contact(io, options_for("/dev/ttyCELLCAL9"));
  io.stop();
  contact.arm(3, std::chrono::seconds{1});
  const auto result = contact.poll_arm();
  ASSERT_TRUE(result);
  EXPECT_FALSE(result->armed);
  EXPECT_EQ(result->arm_id, 3);
  EXPECT_TRUE(contains(said(result->why_not), "port is not open")) << result->why_not;
}

TEST(SerialContact, UnpluggingIsNoticedAndTheSensorIdentifiedAfreshWhenItIsBack) {
  const std::string link = ::testing::TempDir() + "contact-unplug-" + std::to_string(::getpid());
  auto pty = std::make_unique<sim::McuPty>(sim::McuPtyOptions{{}, link});
  RobotThread robot(options_for(link));
  robot.contact.open();
  ASSERT_TRUE(robot.ready()) << robot.contact.status().words;
  std::uint16_t id = 0;
  ASSERT_TRUE(wait_for([&] { return robot.arm(++id).armed; }));

  pty.reset();
  ASSERT_TRUE(wait_for([&] { return robot.contact.status().link == ContactLink::kDown; }));
  ASSERT_TRUE(wait_for([&] { return !robot.snapshot().alive; }));
  EXPECT_FALSE(robot.snapshot().armed);
  ASSERT_TRUE(
      wait_for([&] { return contains(said(robot.contact.status().words), "last attempt"); }));
  const std::string words = said(robot.contact.status().words);
  EXPECT_TRUE(contains(words, "unplugged")) << words;
  EXPECT_TRUE(contains(words, "no such device")) << words;
  EXPECT_FALSE(robot.arm(++id).armed);

  sim::McuPtyOptions back{{}, link};
  back.mcu.boot_id = 77;  // it had no supply: another boot is expected
  pty = std::make_unique<sim::McuPty>(back);
  ASSERT_TRUE(robot.ready()) << robot.contact.status().words;
  EXPECT_FALSE(robot.snapshot().armed);
  EXPECT_TRUE(robot.contact.status().self_test_ok);
  EXPECT_TRUE(wait_for([&] { return robot.arm(++id).armed; })) << robot.contact.status().words;
}

TEST(SerialContact, ClosesAndOpensAgain) {
  sim::McuPty pty({});
  RobotThread robot(options_for(pty.path()));
  for (int i = 0; i < 3; ++i) {
    robot.contact.open();
    ASSERT_TRUE(robot.ready()) << robot.contact.status().words;
    robot.contact.close();
    EXPECT_EQ(robot.contact.status().link, ContactLink::kDown);
  }
}

TEST(SerialContact, SilenceOnAnOpenPortIsAFault) {
  sim::McuPty pty({});
  RobotThread robot(options_for(pty.path()));
  robot.contact.open();
  ASSERT_TRUE(robot.ready()) << robot.contact.status().words;
  sim::McuFaults mute;
  mute.silent = true;
  pty.set_faults(mute);
  // Both: on a busy machine an active sensor may be late, too, and recover.
  ASSERT_TRUE(wait_for([&] {
    return robot.contact.status().link == ContactLink::kFault && !robot.snapshot().alive;
  }));
  pty.set_faults({});
  EXPECT_TRUE(robot.ready());
}

TEST(SerialContact, SaysWhenTheRobotsThreadDoesNotRun) {
  sim::McuPty pty({});
  boost::asio::io_context io;
  SerialContact contact(io, options_for(pty.path()));
  contact.open();
  EXPECT_EQ(contact.status().link, ContactLink::kDown);
  ASSERT_TRUE(wait_for([&] { return contact.status().link == ContactLink::kFault; }));
  EXPECT_TRUE(contains(said(contact.status().words), "thread does not run"));
  io.stop();
}

TEST(SerialContact, NamesABaudRateThatDoesNotFit) {
  sim::McuPtyOptions slow;
  slow.mcu.baud = 115'200;
  sim::McuPty pty(slow);
  RobotThread robot(options_for(pty.path()));
  robot.contact.open();
  ASSERT_TRUE(wait_for([&] { return robot.contact.status().fault == ContactFault::kBaud; }));
  const std::string words = said(robot.contact.status().words);
  EXPECT_TRUE(contains(words, "no valid frame at 1000000 baud")) << words;
  robot.contact.close();

  SerialContactOptions same = options_for(pty.path());
  same.port.baud = 115'200;
  RobotThread fitting(same);
  fitting.contact.open();
  EXPECT_TRUE(fitting.ready()) << fitting.contact.status().words;
}

TEST(SerialContact, AFloodDoesNotKeepTheRobotsThreadFromItsCycle) {
  bool open = false;
  int master = -1, slave = -1;
  char name[256] = {};
  ASSERT_EQ(::openpty(&master, &slave, name, nullptr, nullptr), 0);
  {
    RobotThread robot(options_for(name));
    robot.contact.open();
    ::fcntl(master, F_SETFL, O_NONBLOCK);
    const std::vector<char> noise(4096, 'x');
    const auto end = Steady::now() + milliseconds{300};
    std::size_t sent = 0;
    while (Steady::now() < end) {
      const ssize_t n = ::write(master, noise.data(), noise.size());
      if (n > 0) sent += static_cast<std::size_t>(n);
    }
    open = robot.contact.status().link != ContactLink::kDown;
    // 64 KiB at once and 1 MB/s: the rest waits in the terminal, or is rejected by it.
    EXPECT_LT(sent, std::size_t{3} << 20);
    EXPECT_TRUE(wait_for([&] { return robot.contact.status().quality.crc_errors > 0; }));
  }
  EXPECT_TRUE(open);
  ::close(slave);
  ::close(master);
}

TEST(McuPty, LosesWhatNobodyReadsAndLivesOn) {
  sim::McuPty pty({});
  ASSERT_TRUE(wait_for([&] { return pty.dropped() > 3; }));
  pty.edge(Steady::now(), true);
  const auto repeated = [&] {
    std::uint64_t repeats = 0;
    pty.inspect([&](const sim::Microcontroller& mcu) { repeats = mcu.repeats(); });
    return repeats > 3;
  };
  EXPECT_TRUE(wait_for(repeated)) << "the unacknowledged contact goes on repeating";
}

}  // namespace
}  // namespace cellcal::drivers
