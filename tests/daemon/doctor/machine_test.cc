#include "daemon/doctor/machine.h"

#include <arpa/inet.h>
#include <grp.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>

namespace cellcal::daemon {
namespace {

TEST(AnAddress, IsThisComputersWhereItCanBeBound) {
  EXPECT_TRUE(is_own_address("127.0.0.1"));
  for (const char* other : {"192.0.2.1", "", "localhost", "::1", "127.0.0.1 ", "999.0.0.1"})
    EXPECT_FALSE(is_own_address(other)) << other;
}

TEST(OwnAddresses, HoldTheLoopback) {
  const auto own = own_addresses();
  EXPECT_NE(std::find(own.begin(), own.end(), "127.0.0.1"), own.end());
}

TEST(AUdpPort, IsHeldByTheProgramThatBoundIt) {
  const int fd = ::socket(AF_INET, SOCK_DGRAM, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  ASSERT_EQ(::bind(fd, reinterpret_cast<sockaddr*>(&address), size), 0);
  ASSERT_EQ(::getsockname(fd, reinterpret_cast<sockaddr*>(&address), &size), 0);
  const std::uint16_t port = ntohs(address.sin_port);
  const auto holder = holder_of_udp_port(port);
  ASSERT_TRUE(holder.has_value());
  EXPECT_NE(words(*holder).find("(process " + std::to_string(::getpid()) + ")"), std::string::npos)
      << words(*holder);
  ::close(fd);
  EXPECT_FALSE(holder_of_udp_port(port).has_value());
}

TEST(Rights, OfThisProcessAreReadableAndOfNoneAreNothing) {
  const auto own = rights_of_process(::getpid());
  ASSERT_TRUE(own.has_value());
  EXPECT_EQ(own->uid, ::geteuid());
  EXPECT_NE(std::find(own->groups.begin(), own->groups.end(), ::getegid()), own->groups.end());
  EXPECT_FALSE(rights_of_process(0x7FFFFFF0).has_value());
}

TEST(Rights, OfTheShippedUnitAreAllThatTheRobotsThreadNeeds) {
  const auto read = [](const char* path) {
    std::ifstream file(path);
    return std::string(std::istreambuf_iterator<char>(file), {});
  };
  const ProcessRights rights = rights_in_unit(read(CELLCAL_UNIT));
  EXPECT_TRUE(rights.realtime);
  EXPECT_TRUE(rights.locked_memory);
  // The serial ports' group comes with the user, who is created by the package.
  EXPECT_NE(read(CELLCAL_SYSUSERS).find("\nm     cellcal dialout"), std::string::npos);
  const ProcessRights user = rights_in_unit("[Service]\nUser=root\nSupplementaryGroups=dialout\n");
  EXPECT_EQ(user.uid, 0u);
  EXPECT_NE(std::find(user.groups.begin(), user.groups.end(), 0u), user.groups.end());
  EXPECT_NE(std::find(user.groups.begin(), user.groups.end(), ::getgrnam("dialout")->gr_gid),
            user.groups.end());
  const ProcessRights none = rights_in_unit("[Service]\nLimitRTPRIO=5\nLimitMEMLOCK=64M\n");
  EXPECT_FALSE(none.realtime);
  EXPECT_FALSE(none.locked_memory);
}

TEST(ADevice, MayBeUsedByItsOwnerItsGroupOrEverybody) {
  const auto path =
      std::filesystem::temp_directory_path() / ("doctor-device-" + std::to_string(::getpid()));
  std::ofstream(path) << "x";
  struct stat info {};
  ASSERT_EQ(::stat(path.c_str(), &info), 0);
  ::chmod(path.c_str(), 0660);
  ProcessRights other;
  other.uid = info.st_uid + 1;
  EXPECT_EQ(may_use(other, path), false);
  other.groups.push_back(info.st_gid);
  EXPECT_EQ(may_use(other, path), true);
  ::chmod(path.c_str(), 0640);
  EXPECT_EQ(may_use(other, path), false);
  other.groups.clear();
  ::chmod(path.c_str(), 0666);
  EXPECT_EQ(may_use(other, path), true);
  ProcessRights root;
  root.uid = 0;
  EXPECT_EQ(may_use(root, path), true);
  EXPECT_EQ(may_use({}, path), std::nullopt);
  std::filesystem::remove(path);
  EXPECT_EQ(may_use(other, path), std::nullopt);
}

}  // namespace
}  // namespace cellcal::daemon
