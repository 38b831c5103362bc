#include "black_hole.h"

#include <dlfcn.h>
#include <netdb.h>

#include <condition_variable>
#include <cstring>
#include <mutex>

namespace cellcal::daemon::testing {

namespace {

// Never destroyed: callers may outlive the tests.
struct BlackHole {
  std::mutex mutex;
  std::condition_variable changed;
  int asked = 0, answered = 0;
};
BlackHole& black_hole() {
  static auto* const kOne = new BlackHole;
  return *kOne;
}

}  // namespace

int asked_black_hole() {
  const std::lock_guard lock(black_hole().mutex);
  return black_hole().asked;
}

void answer_black_hole() {
  const std::lock_guard lock(black_hole().mutex);
  ++black_hole().answered;
  black_hole().changed.notify_all();
}

}  // namespace cellcal::daemon::testing

/// Replaces libc's.
extern "C" int getaddrinfo(const char* node, const char* service, const addrinfo* hints,
                           addrinfo** found) {
  using cellcal::daemon::testing::black_hole;
  if (node == nullptr || std::strcmp(node, cellcal::daemon::testing::kBlackHole) != 0) {
    using Function = int(const char*, const char*, const addrinfo*, addrinfo**);
    return reinterpret_cast<Function*>(::dlsym(RTLD_NEXT, "getaddrinfo"))(node, service, hints,
                                                                          found);
  }
  std::unique_lock lock(black_hole().mutex);
  const int before = black_hole().answered;
  ++black_hole().asked;
  black_hole().changed.wait(lock, [&] { return black_hole().answered > before; });
  --black_hole().asked;
  return EAI_AGAIN;
}
