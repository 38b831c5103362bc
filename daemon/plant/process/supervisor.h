#pragma once
// A program whose work may die of what strangers send to it: the work is in a process of its own, which is begun again. libmosquitto
// 2.0 ends its process by an assertion where a broker sends a property that MQTT does not know.

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

/// Its work leaves no core dumps. Its exit status, once it ends of itself; until then it is begun again each time that a signal ends it, `restarts` times so far.
/// SIGTERM and SIGINT are handed on to it, and it is then the last. Before any thread is begun: the work is a child of this process, and is killed
/// with it.
int supervise(const Supervision& limits, const std::function<int(std::uint64_t restarts)>& work);

}  // namespace cellcal::daemon
