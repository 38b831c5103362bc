#pragma once
// Memory for pugixml on the robot's cycle: a bump allocator, installed for one parse.
//
// pugixml uses process-wide allocation functions. Those installed here use the arena that is active
// on the calling thread, and malloc on all other threads and at other times. If an arena is
// exhausted the parse fails as 'out of memory'; it never falls back to malloc.

#include <cstddef>
#include <memory>
#include <string_view>

namespace pugi {
class xml_document;
}

namespace cellcal::drivers {

class XmlArena {
 public:
  /// Installs the process-wide functions once. To be constructed before other threads use pugixml.
  /// Sufficient for documents of up to `most_text` bytes.
  explicit XmlArena(std::size_t most_text);

  /// During its lifetime pugixml uses the arena on this thread. Documents must be destroyed before
  /// it.
  class Scope {
   public:
    explicit Scope(XmlArena& arena);
    ~Scope();
    Scope(const Scope&) = delete;
    Scope& operator=(const Scope&) = delete;
  };

  /// Parses a copy of `text`, which is not longer than `most_text`, within a Scope. False: not well-formed.
  bool load(std::string_view text, pugi::xml_document& document);

  void* allocate(std::size_t bytes);

 private:
  std::unique_ptr<char[]> text_;
  std::unique_ptr<std::byte[]> memory_;
  std::size_t size_;
  std::size_t used_ = 0;
};

}  // namespace cellcal::drivers
