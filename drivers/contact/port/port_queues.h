#pragma once
// What crosses between the robot's thread and the threads of an open port: bytes with the time that
// they came, frames to be sent, and a call for each side. Neither side ever waits for the other.

#include <sys/eventfd.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <boost/lockfree/spsc_queue.hpp>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <string>

#include "drivers/contact/wire/ctp.h"
#include "drivers/error.h"
#include "drivers/time.h"

namespace cellcal::drivers {

/// A call to a thread that waits in poll() or in its io_context. Calling never blocks.
class Call {
 public:
  Call() : fd_(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {
    if (fd_ < 0) throw DriverError(std::string("eventfd: ") + std::strerror(errno));
  }
  ~Call() { ::close(fd_); }
  Call(const Call&) = delete;
  Call& operator=(const Call&) = delete;

  int fd() const { return fd_; }
  void make() {
    const std::uint64_t one = 1;
    // Fails only when the counter is full, and then the other side is called already.
    [[maybe_unused]] const auto written = ::write(fd_, &one, sizeof(one));
  }
  void take() {
    std::uint64_t calls = 0;
    // Nothing to read means that it was taken the last time.
    [[maybe_unused]] const auto n = ::read(fd_, &calls, sizeof(calls));
  }

 private:
  int fd_ = -1;
};

/// What the port has to tell the robot's thread, in order.
struct PortNews {
  enum class Kind { kOpened, kBytes, kLost } kind = Kind::kBytes;
  std::uint32_t opening = 0;  ///< which of the port's openings it belongs to
  int error = 0;              ///< kLost: errno, 0: end of file
  TimePoint t{};              ///< when it was read
  TimePoint arrived{};        ///< when the bytes came into this computer
  std::uint16_t size = 0;
  static constexpr std::size_t kMost = 224;  ///< a piece is 256 bytes in all
  std::array<std::uint8_t, kMost> bytes{};
};

/// What the robot's thread sends. A frame of another opening is thrown away.
struct PortFrame {
  std::uint32_t opening = 0;
  std::uint16_t size = 0;
  std::array<std::uint8_t, CTP_MAX_WIRE> bytes{};
};

struct PortQueues {
  /// 58 KiB: what a tty itself holds back while nobody reads.
  boost::lockfree::spsc_queue<PortNews, boost::lockfree::capacity<256>> news;
  boost::lockfree::spsc_queue<PortFrame, boost::lockfree::capacity<64>> frames;
  Call news_call, frames_call;
  std::atomic<std::uint64_t> unsent{0};  ///< frames that the port did not take
};

}  // namespace cellcal::drivers
