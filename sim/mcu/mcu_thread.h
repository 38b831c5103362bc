#pragma once
// The emulated sensor in real time, on its own thread; derived classes provide the line.

#include <atomic>
#include <functional>
#include <mutex>
#include <string>
#include <thread>

#include "sim/mcu/microcontroller.h"

namespace cellcal::sim {

/// RAII file descriptor.
class Fd {
 public:
  Fd() = default;
  explicit Fd(int fd) : fd_(fd) {}
  Fd(const Fd&) = delete;
  Fd& operator=(const Fd&) = delete;
  ~Fd() { reset(); }
  void reset(int fd = -1);
  int get() const { return fd_; }

 private:
  int fd_ = -1;
};

/// All public functions are thread-safe.
class McuThread {
 public:
  virtual ~McuThread() = default;

  /// Device name for a driver: a terminal's slave end, or "udp:ADDRESS:PORT".
  const std::string& path() const { return path_; }
  /// Steady-clock time of the edge, possibly in the future.
  void edge(TimePoint t, bool closed);
  /// All edges up to t were announced: the emulation waits there for the next call, and its data are late. A heartbeat
  /// never denies an edge that a delayed arm announces afterwards. Not called: runs freely.
  void known_until(TimePoint t);
  void set_faults(const McuFaults& faults);
  /// As Microcontroller::on_output, on the emulation's thread or that of edge().
  void on_output(Microcontroller::OnOutput callback);
  void reset(std::uint8_t cause = CTP_RESET_PIN);
  /// Runs on the calling thread with the emulation suspended.
  void inspect(const std::function<void(const Microcontroller&)>& visit) const;
  /// Frames dropped because the line was not read.
  std::uint64_t dropped() const { return dropped_; }

 protected:
  /// `realtime`: SCHED_FIFO, if permitted, since a microcontroller has its own processor.
  McuThread(const McuOptions& options, bool realtime);
  /// To be called at the end of the constructor, and at the beginning of the destructor, of each
  /// derived class.
  void start();
  void stop();

  // Called on the emulation's thread.
  virtual int fd() const = 0;
  virtual void read_host() = 0;
  /// Atomic; false: no reader.
  virtual bool write_host(const Microcontroller::Output& output) = 0;
  /// False: the line is not open, and waiting for it would return immediately.
  virtual bool can_wait() { return true; }

  void act(const std::function<void(Microcontroller&)>& action);
  [[noreturn]] static void fail(const char* what);

  std::string path_;

 private:
  void run();
  void wake();
  void wait(TimePoint next);

  const bool realtime_;
  Fd wake_;
  mutable std::mutex mutex_;
  Microcontroller mcu_;
  TimePoint known_until_ = TimePoint::max();
  bool held_ = false;  ///< waits for known_until()
  std::atomic<bool> stop_{false};
  std::atomic<std::uint64_t> dropped_{0};
  std::thread thread_;
};

// The emulated sensor in real time on a pseudo-terminal.

struct McuPtyOptions {
  McuOptions mcu;
  std::string symlink;  ///< second name of the terminal, replaced if it is a symlink; may be empty
  bool realtime = false;  ///< SCHED_FIFO, if permitted
};

/// Construction opens the terminal and starts the thread; throws std::system_error. Destruction
/// closes the master's end: for the driver, the sensor is unplugged.
class McuPty final : public McuThread {
 public:
  explicit McuPty(const McuPtyOptions& options);
  ~McuPty() override;

 private:
  void open_terminal();
  void link();
  int fd() const override { return master_.get(); }
  void read_host() override;
  bool write_host(const Microcontroller::Output& output) override;
  bool can_wait() override;
  void listen_as_the_host_does();

  const int baud_;
  int host_baud_ = baud_;
  std::string symlink_;
  Fd master_;
  bool operator_present_ = false;
};

// The emulated sensor on Ethernet, in real time on a UDP socket: the firmware's core with its rule of
// one host at a time.

struct McuUdpOptions {
  McuOptions mcu;
  std::string address = "127.0.0.1";
  std::uint16_t port = 0;  ///< 0: a free one
  bool realtime = false;   ///< SCHED_FIFO, if permitted
};

/// Options of the board on Ethernet: 100 Mbit/s, datagrams.
McuOptions on_ethernet(McuOptions options);

/// Construction opens the socket and starts the thread; throws std::system_error. Destruction closes
/// it: the board has no supply.
class McuUdp final : public McuThread {
 public:
  explicit McuUdp(const McuUdpOptions& options);
  ~McuUdp() override { stop(); }

 private:
  int fd() const override { return socket_.get(); }
  void read_host() override;
  bool write_host(const Microcontroller::Output& output) override;

  Fd socket_;
};

}  // namespace cellcal::sim
