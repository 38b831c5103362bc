#include "drivers/kuka/wire/xml_arena.h"

#include <cstdlib>
#include <mutex>
#include <pugixml.hpp>

namespace cellcal::drivers {
namespace {

thread_local XmlArena* active = nullptr;

void* allocate_for_pugi(std::size_t bytes) {
  return active != nullptr ? active->allocate(bytes) : std::malloc(bytes);
}

void release_for_pugi(void* memory) {
  // Within a scope every block belongs to the arena, which is cleared as a whole.
  if (active == nullptr) std::free(memory);
}

}  // namespace

XmlArena::XmlArena(std::size_t bytes)
    : memory_(std::make_unique<std::byte[]>(bytes)), size_(bytes) {
  static std::once_flag installed;
  std::call_once(installed, [] {
    pugi::set_memory_management_functions(&allocate_for_pugi, &release_for_pugi);
  });
}

void* XmlArena::allocate(std::size_t bytes) {
  constexpr std::size_t kAlign = alignof(std::max_align_t);
  if (bytes > size_) return nullptr;
  const std::size_t padded = (bytes + kAlign - 1) / kAlign * kAlign;
  if (padded > size_ - used_) return nullptr;
  void* block = memory_.get() + used_;
  used_ += padded;
  return block;
}

XmlArena::Scope::Scope(XmlArena& arena) {
  arena.used_ = 0;
  active = &arena;
}

XmlArena::Scope::~Scope() { active = nullptr; }

}  // namespace cellcal::drivers
