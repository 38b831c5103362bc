#pragma once
// One io_context on one thread: it owns the robot's socket and the contact sensor's port, so that
// a contact reaches the next reply without crossing threads.
//
// Real time where the machine permits it: SCHED_FIFO keeps the reply below 1 ms while other
// processes burn the processors, locked memory keeps page faults off the cycle. Where it is not
// permitted the thread runs all the same and says so once, by name.

#include <memory>
#include <string>
#include <vector>

namespace boost::asio {
class io_context;
}

namespace cellcal::drivers {

struct IoThreadOptions {
  bool realtime = true;           ///< ask for SCHED_FIFO and locked memory
  int priority = 60;              ///< SCHED_FIFO 1..99; above the kernel's threaded interrupts (50)
  bool quiet = false;             ///< warnings() alone tell what was not had; nothing is logged
  std::string name = "robot-io";  ///< at most 15 characters, as top and ps show it
};

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
  /// What real time could not be had, each with what to do. Also logged, once, by start().
  const std::vector<std::string>& warnings() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace cellcal::drivers
