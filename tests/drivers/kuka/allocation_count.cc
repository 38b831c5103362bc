// In a separate file: if the compiler sees both new and delete, it reports a mismatch.

#include "tests/drivers/kuka/allocation_count.h"

#include <atomic>
#include <cstdlib>
#include <new>

namespace {

std::atomic<long> allocations{0};
thread_local long here = 0;

}  // namespace

// Both forms: a sanitizer has its own one of each that is not replaced.
void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
  allocations.fetch_add(1, std::memory_order_relaxed);
  ++here;
  return std::malloc(size == 0 ? 1 : size);
}
void* operator new(std::size_t size) {
  if (void* memory = operator new(size, std::nothrow)) return memory;
  throw std::bad_alloc();
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }

namespace cellcal::drivers {

long allocation_count() { return allocations.load(std::memory_order_relaxed); }
long allocations_of_this_thread() { return here; }

}  // namespace cellcal::drivers
