#pragma once
// Memory for pugixml on the robot's cycle: a bump allocator that is put in place for one parse.
//
// pugixml takes its memory from process-wide functions. Those installed here serve from the arena
// that is active on the calling thread, and from malloc on all other threads and at other times.
// When an arena is exhausted the parse fails as 'out of memory'; it never falls back to malloc.

#include <cstddef>
#include <memory>

namespace cellcal::drivers {

class XmlArena {
 public:
  /// Installs the process-wide functions once. Construct before other threads use pugixml.
  explicit XmlArena(std::size_t bytes);

  /// While this lives, pugixml on this thread uses the arena. Documents must be gone before it.
  class Scope {
   public:
    explicit Scope(XmlArena& arena);
    ~Scope();
    Scope(const Scope&) = delete;
    Scope& operator=(const Scope&) = delete;
  };

  void* allocate(std::size_t bytes);

 private:
  std::unique_ptr<std::byte[]> memory_;
  std::size_t size_;
  std::size_t used_ = 0;
};

}  // namespace cellcal::drivers
