#pragma once
// Supervision of work that input from strangers may terminate: it runs in a child process, which is restarted. libmosquitto 2.0
// aborts on an MQTT property that it does not know.

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>

namespace cellcal::daemon {

struct Supervision {
  std::size_t most_bytes = 0;  ///< of data that the work may hold; what asks for more gets none
  std::chrono::milliseconds first_wait{1000}, longest_wait{60000};  ///< until it is begun again
  std::chrono::milliseconds lives{
      60000};  ///< work that lived so long is begun again at once, as the first time
};

/// Runs `work` in a child process and returns its exit status. A child that a signal ends is restarted, `restarts` times so far,
/// unless the signal is a SIGTERM or SIGINT that was passed on to it. The child is killed with this process and leaves no core
/// dumps. Call before any thread is started. Throws std::system_error where no process can be created.
int supervise(const Supervision& limits, const std::function<int(std::uint64_t restarts)>& work);

}  // namespace cellcal::daemon
