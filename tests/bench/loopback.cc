#include "tests/bench/loopback.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <pthread.h>
#include <pty.h>
#include <sched.h>
#include <sys/socket.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <stdexcept>

namespace cellcal::bench {
namespace {

[[noreturn]] void fail(const char* what) {
  throw std::runtime_error(std::string(what) + ": " + std::strerror(errno));
}

sockaddr_in loopback(std::uint16_t port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  address.sin_port = htons(port);
  return address;
}

}  // namespace

bool request_realtime(int priority) {
  sched_param param{};
  param.sched_priority = priority;
  return pthread_setschedparam(pthread_self(), SCHED_FIFO, &param) == 0;
}

Udp::Udp() : fd_(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {
  const sockaddr_in any = loopback(0);
  if (fd_ < 0 || ::bind(fd_, reinterpret_cast<const sockaddr*>(&any), sizeof any) != 0) {
    fail("UDP socket on the loopback");
  }
}

Udp::~Udp() { ::close(fd_); }

void Udp::connect(std::uint16_t port) {
  const sockaddr_in to = loopback(port);
  if (::connect(fd_, reinterpret_cast<const sockaddr*>(&to), sizeof to) != 0) {
    fail("UDP on the loopback");
  }
}

std::uint16_t Udp::port() const {
  sockaddr_in self{};
  socklen_t size = sizeof self;
  ::getsockname(fd_, reinterpret_cast<sockaddr*>(&self), &size);
  return ntohs(self.sin_port);
}

Terminal::Terminal() {
  std::array<char, 256> name{};
  termios tio{};
  if (::openpty(&master_, &slave_, nullptr, nullptr, nullptr) != 0) fail("pseudo-terminal");
  if (::ttyname_r(slave_, name.data(), name.size()) != 0 || ::tcgetattr(slave_, &tio) != 0) {
    fail("pseudo-terminal");
  }
  ::cfmakeraw(&tio);
  if (::tcsetattr(slave_, TCSANOW, &tio) != 0 || ::fcntl(master_, F_SETFL, O_NONBLOCK) != 0) {
    fail("pseudo-terminal");
  }
  path_ = name.data();
}

Terminal::~Terminal() {
  ::close(slave_);
  ::close(master_);
}

}  // namespace cellcal::bench
