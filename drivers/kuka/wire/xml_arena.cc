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

// "<a>b" is the worst case for pugixml, with two nodes of 64 bytes for four bytes of text: 32 bytes
// of memory per byte of text, plus half of that for page remainders.
XmlArena::XmlArena(std::size_t most_text)
    : text_(std::make_unique<char[]>(most_text)), size_(most_text * 48) {
  memory_ = std::make_unique<std::byte[]>(size_);
  static std::once_flag installed;
  std::call_once(installed, [] {
    pugi::set_memory_management_functions(&allocate_for_pugi, &release_for_pugi);
  });
}

bool XmlArena::load(std::string_view text, pugi::xml_document& document) {
  text.copy(text_.get(), text.size());
  // The encoding is fixed: detection could make pugixml convert, and allocate.
  return document.load_buffer_inplace(text_.get(), text.size(), pugi::parse_default,
                                      pugi::encoding_utf8);
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
