// SerialContact on a real UDP socket, with the emulated board on another. Nothing is timed.

#include <arpa/inet.h>
#include <sys/socket.h>
#include <unistd.h>

#include "drivers/contact/port/adapter.h"
#include "drivers/contact/port/port.h"
#include "rig.h"
#include "robot_thread.h"
#include "sim/mcu/mcu_thread.h"
#include "tests/drivers/said.h"

namespace cellcal::drivers {
namespace {

/// Another socket on loopback.
class Peer {
 public:
  Peer() : fd_(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in own{};
    own.sin_family = AF_INET;
    own.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof own;
    EXPECT_EQ(::bind(fd_, reinterpret_cast<sockaddr*>(&own), size), 0);
    EXPECT_EQ(::getsockname(fd_, reinterpret_cast<sockaddr*>(&own), &size), 0);
    port_ = ntohs(own.sin_port);
  }
  ~Peer() { ::close(fd_); }
  Peer(const Peer&) = delete;
  Peer& operator=(const Peer&) = delete;

  std::string device() const { return "udp:127.0.0.1:" + std::to_string(port_); }
  /// Replies are sent to the last sender.
  void learn() {
    char some[64];
    socklen_t size = sizeof from_;
    EXPECT_GT(::recvfrom(fd_, some, sizeof some, 0, reinterpret_cast<sockaddr*>(&from_), &size), 0);
  }
  void send(std::span<const std::uint8_t> bytes, const sockaddr_in& to) const {
    EXPECT_EQ(::sendto(fd_, bytes.data(), bytes.size(), 0, reinterpret_cast<const sockaddr*>(&to),
                       sizeof to),
              static_cast<ssize_t>(bytes.size()));
  }
  const sockaddr_in& from() const { return from_; }

 private:
  int fd_;
  std::uint16_t port_ = 0;
  sockaddr_in from_{};
};

using Bytes = std::vector<std::uint8_t>;

Bytes read_now(Port& port) {
  std::array<std::uint8_t, 224> into{};
  const PortReading reading = port.read(into);
  EXPECT_FALSE(reading.lost);
  return {into.begin(), into.begin() + static_cast<std::ptrdiff_t>(reading.size)};
}

TEST(UdpDevice, IsAnIPv4AddressAndAPortAndNothingElse) {
  EXPECT_TRUE(udp_device_of("udp:169.254.67.84:4300"));
  for (const char* wrong :
       {"", "udp:", "udp:1.2.3.4", "udp:1.2.3.4:", "udp::4300", "udp:1.2.3:4300", "udp:1.2.3.4:0",
        "udp:1.2.3.4:65536", "udp:1.2.3.4:43x", "udp:board:4300", "udp:0.0.0.0:4300",
        "udp:224.0.0.1:4300", "udp:255.255.255.255:4300", "udp:1.2.3.4: 4300", "/dev/ttyUSB0"}) {
    EXPECT_FALSE(udp_device_of(wrong)) << wrong;
  }
  EXPECT_THROW(open_port({"udp:board:4300"}), ConfigError);
}

TEST(UdpPort, IsOneProgramsAlone) {
  const std::unique_ptr<Port> first = open_port({"udp:127.0.0.1:4300"});
  EXPECT_THROW(open_port({"udp:127.0.0.1:4300"}), DriverError);
}

TEST(UdpPort, HearsTheBoardAloneAndEndsACutFrameWithItsDatagram) {
  Peer board, stranger;
  const std::unique_ptr<Port> port = open_port({board.device()});
  const Bytes hello{1, 0};
  ASSERT_TRUE(port->write(hello));
  board.learn();
  stranger.send(Bytes{7, 7, 0}, board.from());
  EXPECT_TRUE(read_now(*port).empty());
  board.send(Bytes{5, 6, 0}, board.from());
  EXPECT_EQ(read_now(*port), (Bytes{5, 6, 0}));
  board.send(Bytes{5, 6}, board.from());
  EXPECT_EQ(read_now(*port), (Bytes{5, 6, 0}));
  board.send(Bytes(1000, 9), board.from());
  EXPECT_LE(read_now(*port).size(), 224u);
  EXPECT_TRUE(read_now(*port).empty());
}

TEST(UdpPort, ABoardThatIsNotThereIsSilenceAndNoLostPort) {
  std::string device;
  { device = Peer().device(); }
  const std::unique_ptr<Port> port = open_port({device});
  for (int i = 0; i < 5; ++i) {
    EXPECT_TRUE(port->write(Bytes{1, 0}));
    EXPECT_TRUE(read_now(*port).empty());
  }
}

TEST(UdpPort, GivesTheKernelsTimeOfArrivalHoweverLateItIsRead) {
  Peer board;
  const std::unique_ptr<Port> port = open_port({board.device()});
  ASSERT_TRUE(port->write(Bytes{1, 0}));
  board.learn();
  // The kernel begins to stamp some time after the first socket of the machine asks for it, and
  // until then stamps at the reading; the two clocks are read one after the other.
  bool stamped = false;
  for (int attempt = 0; attempt < 20 && !stamped; ++attempt) {
    const TimePoint before = Steady::now();
    board.send(Bytes{5, 0}, board.from());
    const TimePoint sent = Steady::now();
    std::this_thread::sleep_for(milliseconds{30});
    std::array<std::uint8_t, 224> into{};
    const PortReading reading = port->read(into);
    ASSERT_EQ(reading.size, 2u);
    EXPECT_GE(reading.arrived, before - milliseconds{5});
    stamped = reading.arrived <= sent + milliseconds{25};
  }
  EXPECT_TRUE(stamped);
}

TEST(UdpPort, LoopbackIsAnInterfaceWithoutAWire) {
  const auto found = interface_to("udp:127.0.0.1:4300");
  ASSERT_TRUE(found);
  EXPECT_EQ(found->name, "lo");
  EXPECT_FALSE(found->wireless);
}

TEST(ContactOverUdp, IdentifiesArmsAndReportsATouchWithItsTime) {
  sim::McuUdp board({});
  RobotThread robot(options_for(board.path()));
  robot.contact.open();
  expect_touch_with_its_time(robot, board);
}

TEST(ContactOverUdp, ABoardThatWasOffIsIdentifiedAfreshAndSaysWhatToCheck) {
  auto board = std::make_unique<sim::McuUdp>(sim::McuUdpOptions{});
  const auto device = udp_device_of(board->path());
  ASSERT_TRUE(device);
  RobotThread robot(options_for(board->path()));
  robot.contact.open();
  ASSERT_TRUE(robot.ready()) << robot.contact.status().words;
  board.reset();
  ASSERT_TRUE(wait_for([&] {
    return robot.contact.status().fault == ContactFault::kSilent && !robot.snapshot().alive;
  }));
  sim::McuUdpOptions back;
  back.port = ntohs(device->sin_port);
  back.mcu.boot_id = 77;
  board = std::make_unique<sim::McuUdp>(back);
  // It has restarted during use: the operator acknowledges that.
  ASSERT_TRUE(wait_for([&] { return robot.contact.status().fault == ContactFault::kLostState; }))
      << robot.contact.status().words;
  robot.contact.self_test();
  EXPECT_TRUE(robot.ready()) << robot.contact.status().words;
}

TEST(ContactOverUdp, ANextSessionIsHeardOnceTheLastHasLeft) {
  sim::McuUdp board({});
  RobotThread robot(options_for(board.path()));
  for (int i = 0; i < 2; ++i) {
    robot.contact.open();
    ASSERT_TRUE(robot.ready()) << robot.contact.status().words;
    robot.contact.close();
  }
}

TEST(ContactOverUdp, SaysWhatToCheckWhereNothingAnswers) {
  Peer mute;
  RobotThread robot(options_for(mute.device()));
  robot.contact.open();
  ASSERT_TRUE(wait_for([&] {
    return contains(said(robot.contact.status().words), "the address in [contact] device");
  })) << robot.contact.status().words;
}

}  // namespace
}  // namespace cellcal::drivers
