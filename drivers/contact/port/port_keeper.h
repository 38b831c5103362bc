#pragma once
// Owns the port: opens it, has its bytes transferred to and from the queues, and after a loss
// closes and reopens it with back-off. Opening and closing a device can take longer than the
// robot's cycle; both happen on threads other than the robot's.

#include <pthread.h>
#include <sched.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <boost/lockfree/spsc_queue.hpp>
#include <cerrno>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <cstring>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "drivers/contact/port/port.h"
#include "drivers/contact/wire/ctp.h"
#include "drivers/error.h"
#include "drivers/time.h"

namespace cellcal::drivers {

// Communication between the robot's thread and the threads of an open port: bytes with their
// arrival time, frames to be sent, and a notification for each side. Neither side waits for the
// other.

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

// Transfers bytes between an open port and the queues, on two threads of its own: the only code
// that reads, writes or polls a port.
//
// Separate from the robot's thread, because reading and polling a terminal wait for the kernel's
// worker that fills it (n_tty_read, n_tty_poll: __flush_work), which has normal priority. Two
// threads, because the reader may wait there while the computer is busy, and the keep-alive must be
// sent meanwhile.

struct PortPumpOptions {
  std::uint32_t opening = 0;  ///< number of this opening for the robot's thread
  /// SCHED_FIFO priority of both threads; 0: none. Above the robot's thread, so that bytes are
  /// available before a simultaneous packet is answered. They are mostly idle, and their load is
  /// bounded: see the budget in the .cc.
  int priority = 0;
};

class PortPump {
 public:
  /// `lost` is called once, on the reader's thread, when the port is lost; nothing is read or sent
  /// from then on. The queues must outlive this object.
  PortPump(std::unique_ptr<Port> port, const PortPumpOptions& options, PortQueues& queues,
           std::function<void()> lost);
  /// Sends queued frames, joins both threads, closes the port.
  ~PortPump();

 private:
  void read_port();
  void write_port();
  void report(const PortUpdate& news);
  void send_queued();

  const std::unique_ptr<Port> port_;
  const PortPumpOptions options_;
  PortQueues& queues_;
  const std::function<void()> lost_;
  std::atomic<bool> stop_{false};
  Call stop_reading_;
  std::thread reader_, writer_;
};

struct PortKeeperOptions {
  PortOptions port;
  std::chrono::milliseconds first, longest;  ///< pauses between attempts
};

class PortKeeper {
 public:
  /// The queues must outlive this object.
  PortKeeper(PortKeeperOptions options, PortQueues& queues);
  ~PortKeeper();

  /// Number of the next opening: PortUpdate of it and of later ones have at least this number.
  std::uint32_t next_opening() const;
  /// Opens the port, which must be closed, on this thread. Throws DriverError.
  void open();
  /// Sends queued frames, closes the port, and stops reopening.
  void close();
  /// Error of the last attempt; empty if there was none since the loss of the port.
  std::string last_error() const;
  /// Warning of the port as last opened.
  std::string warning() const;

 private:
  void run();
  std::unique_ptr<PortPump> open_now();

  const PortKeeperOptions options_;
  PortQueues& queues_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::unique_ptr<PortPump> pump_;
  std::uint32_t openings_ = 0;
  std::string last_error_, warning_;
  bool stop_ = false, wanted_ = false, lost_ = false, busy_ = false;
  std::thread thread_;
};

}  // namespace cellcal::drivers
