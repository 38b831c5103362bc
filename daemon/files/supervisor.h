#pragma once
// Supervision of work that input from strangers may terminate: it runs in a child process, which is restarted. libmosquitto 2.0
// aborts on an MQTT property that it does not know.

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>

namespace cellcal::daemon {

struct Supervision {
  std::size_t most_bytes = 0;  ///< data limit of the work; larger requests fail
  std::chrono::milliseconds first_wait{1000}, longest_wait{60000};  ///< delay before a restart
  std::chrono::milliseconds lives{/// After this lifetime the delay starts over.
                                  60000};
};

/// Runs `work` in a child process and returns its exit status. A child terminated by a signal is restarted
/// (`restarts` counts so far), unless the signal is a forwarded SIGTERM or SIGINT. The child is killed with
/// this process and leaves no core dumps. To be called before any thread is started. Throws std::system_error
/// where no process can be created.
int supervise(const Supervision& limits, const std::function<int(std::uint64_t restarts)>& work);

}  // namespace cellcal::daemon
