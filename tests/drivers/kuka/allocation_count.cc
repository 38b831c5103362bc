// In a separate file: if the compiler sees both new and delete, it reports a mismatch.

#include "tests/drivers/kuka/allocation_count.h"

#include <atomic>
#include <cstdlib>
#include <new>

namespace {

std::atomic<long> allocations{0};
thread_local long here = 0;

}  // namespace

void* operator new(std::size_t size) {
  allocations.fetch_add(1, std::memory_order_relaxed);
  ++here;
  if (void* memory = std::malloc(size == 0 ? 1 : size)) return memory;
  throw std::bad_alloc();
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }

namespace cellcal::drivers {

long allocation_count() { return allocations.load(std::memory_order_relaxed); }
long allocations_of_this_thread() { return here; }

}  // namespace cellcal::drivers
