#pragma once
// One io_context on one thread: it owns the robot's socket and all of the contact sensor's
// protocol. The sensor's bytes come to it by a queue (contact/port_pump.h): reading a port can
// sleep.
//
// Real time where the machine permits it: SCHED_FIFO keeps the reply below 1 ms while other
// processes burn the processors, locked memory keeps page faults off the cycle. Where it is not
// permitted the thread runs all the same and says so once, by name.

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace boost::asio {
class io_context;
}

namespace cellcal::drivers {

struct IoThreadOptions {
  bool realtime = true;           ///< ask for SCHED_FIFO and locked memory
  int priority = 59;              ///< SCHED_FIFO 1..99; above the kernel's threaded interrupts (50)
  bool quiet = false;             ///< warnings() alone tell what was not had; nothing is logged
  std::string name = "robot-io";  ///< at most 15 characters, as top and ps show it
};

/// Of the threads that carry the contact sensor's bytes (contact/port_pump.h): just above the
/// robot's. The highest that is asked for, and what the service's unit grants (LimitRTPRIO).
inline constexpr int kPortPriority = IoThreadOptions{}.priority + 1;

class IoThread {
 public:
  explicit IoThread(IoThreadOptions options = {});
  ~IoThread();
  IoThread(const IoThread&) = delete;
  IoThread& operator=(const IoThread&) = delete;

  /// Starts the thread. Returns when its scheduling is settled; warnings() is then complete.
  void start();
  /// Lets no further handler run and joins the thread. Whatever lives on the context must be closed
  /// before, or destroyed after. Idempotent.
  void stop();

  boost::asio::io_context& context();
  /// Goes on ten times a second while handlers are run. Whoever watches the thread compares two of
  /// them and asks nothing of it.
  std::uint64_t beats() const;
  /// What real time could not be had, each with what to do. Also logged, once, by start().
  const std::vector<std::string>& warnings() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace cellcal::drivers
