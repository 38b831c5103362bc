#pragma once
// Communication between the robot's thread and the threads of an open port: bytes with their
// arrival time, frames to be sent, and a notification for each side. Neither side waits for the
// other.

#include <pthread.h>
#include <sched.h>
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

/// Notification of a thread that waits in poll() or in its io_context. Never blocks.
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
    // Fails only if the counter is full, in which case the other side is already notified.
    [[maybe_unused]] const auto written = ::write(fd_, &one, sizeof(one));
  }
  void take() {
    std::uint64_t calls = 0;
    // An empty read means that it was consumed before.
    [[maybe_unused]] const auto n = ::read(fd_, &calls, sizeof(calls));
  }

 private:
  int fd_ = -1;
};

/// Messages from the port to the robot's thread, in order.
struct PortUpdate {
  enum class Kind { kOpened, kBytes, kLost } kind = Kind::kBytes;
  std::uint32_t opening = 0;  ///< number of the port's opening
  int error = 0;              ///< kLost: errno, 0: end of file
  TimePoint t{};              ///< time of reading
  TimePoint arrived{};        ///< arrival of the bytes in this computer
  std::uint16_t size = 0;
  static constexpr std::size_t kMost = 224;  ///< for a total size of 256 bytes
  std::array<std::uint8_t, kMost> bytes{};
};

/// A frame to be sent by the robot's thread. Frames of another opening are discarded.
struct PortFrame {
  std::uint32_t opening = 0;
  std::uint16_t size = 0;
  std::array<std::uint8_t, CTP_MAX_WIRE> bytes{};
};

struct PortQueues {
  /// 58 KiB: the size that a tty buffers without a reader.
  boost::lockfree::spsc_queue<PortUpdate, boost::lockfree::capacity<256>> news;
  boost::lockfree::spsc_queue<PortFrame, boost::lockfree::capacity<64>> frames;
  Call news_call, frames_call;
  std::atomic<std::uint64_t> unsent{0};  ///< frames rejected by the port
};

// Name and priority of the I/O threads of a port.

/// Sets the calling thread's name (at most 15 characters) and SCHED_FIFO priority; 0: none.
inline void configure_port_thread(const char* name, int priority) {
  ::pthread_setname_np(::pthread_self(), name);
  if (priority == 0) return;
  sched_param param{};
  param.sched_priority = priority;
  // If not permitted: the robot's thread, which requests the same, reports the warning.
  [[maybe_unused]] const int refused =
      ::pthread_setschedparam(::pthread_self(), SCHED_FIFO, &param);
}

}  // namespace cellcal::drivers
