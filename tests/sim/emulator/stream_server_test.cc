// Channel files of other software, on real sockets. Independent of timing.

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <thread>

#include "drivers/error.h"
#include "sim/krc/eki_server.h"

namespace cellcal::sim {
namespace {

std::string file(const char* protocol) {
  return std::string(
             "<ETHERNETKRL><CONFIGURATION><EXTERNAL><TYPE>Client</TYPE></EXTERNAL><INTERNAL>"
             "<PORT>54600</PORT><PROTOCOL>") +
         protocol +
         "</PROTOCOL></INTERNAL></CONFIGURATION><RECEIVE><XML>"
         "<ELEMENT Tag=\"Go/@A1\" Type=\"REAL\"/></XML></RECEIVE><SEND><XML>"
         "<ELEMENT Tag=\"State/@A1\"/></XML></SEND></ETHERNETKRL>";
}

class Client {
 public:
  Client(int type, std::uint16_t port) : socket_(::socket(AF_INET, type | SOCK_CLOEXEC, 0)) {
    sockaddr_in there{};
    there.sin_family = AF_INET;
    there.sin_port = htons(port);
    there.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    // Sufficient for any machine; reached only on failure.
    const timeval timeout{20, 0};
    ::setsockopt(socket_, SOL_SOCKET, SO_RCVTIMEO, &timeout, sizeof timeout);
    EXPECT_EQ(::connect(socket_, reinterpret_cast<sockaddr*>(&there), sizeof there), 0);
  }
  ~Client() { ::close(socket_); }
  void send(const std::string& text) {
    EXPECT_EQ(::send(socket_, text.data(), text.size(), MSG_NOSIGNAL),
              static_cast<ssize_t>(text.size()));
  }
  /// Next data; empty at the end of the connection.
  std::string receive() {
    std::array<char, 4096> buffer{};
    const ssize_t got = ::recv(socket_, buffer.data(), buffer.size(), 0);
    EXPECT_GE(got, 0) << "nothing came";
    return {buffer.data(), static_cast<std::size_t>(std::max<ssize_t>(got, 0))};
  }
  bool sees(const std::string& words) {
    for (std::string seen, more; seen.find(words) == std::string::npos; seen += more) {
      if ((more = receive()).empty()) return false;
    }
    return true;
  }

 private:
  int socket_;
};

TEST(EkiStreamServer, ServesAChannelOnTcpAndOneOnUdp) {
  EkiStreamConfig config;
  config.channel_xml = {file("TCP"), file("UDP")};
  EkiStreamServerOptions options;
  options.free_ports = true;
  EkiStreamServer server(config, options);
  server.start();
  Client tcp(SOCK_STREAM, server.port(0)), udp(SOCK_DGRAM, server.port(1));
  EXPECT_TRUE(tcp.sees("<State A1=\"0.000000\"/>"));
  udp.send("here");
  EXPECT_TRUE(udp.sees("<State A1=\"0.000000\"/>"));
  tcp.send("<Go A1=\"0.5\"/>");
  EXPECT_TRUE(tcp.sees("<State A1=\"0.500000\"/>"));
  udp.send("<Go A1=\"1.5\" />");
  EXPECT_TRUE(udp.sees("<State A1=\"1.500000\"/>"));
}

TEST(EkiStreamServer, TakesOneTcpClient) {
  EkiStreamConfig config;
  config.channel_xml = {file("TCP")};
  EkiStreamServerOptions options;
  options.free_ports = true;
  EkiStreamServer server(config, options);
  server.start();
  Client first(SOCK_STREAM, server.port(0));
  EXPECT_TRUE(first.sees("<State"));
  Client second(SOCK_STREAM, server.port(0));
  EXPECT_EQ(second.receive(), "");
  EXPECT_TRUE(first.sees("<State"));
}

TEST(EkiStreamServer, AddressThatIsNoneIsNamed) {
  EkiStreamConfig config;
  config.channel_xml = {file("TCP")};
  EkiStreamServerOptions options;
  options.address = "nowhere";
  EkiStreamServer server(config, options);
  EXPECT_THROW(server.start(), drivers::DriverError);
}

}  // namespace
}  // namespace cellcal::sim
