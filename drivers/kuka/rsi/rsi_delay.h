#pragma once
// What the controller's count of late replies (Delay) says: how many came late, and whether it
// takes any of ours at all. A wrong SENTYPE or IPOC is discarded without a word: only Delay tells.

#include <cstdint>
#include <optional>

namespace cellcal::drivers {

class DelayWatch {
 public:
  /// Another session: what follows is compared with its first packet.
  void begin_session();
  /// The first packet of a session that is answered; Delay, if it is sent.
  void begin_answers(std::optional<std::uint32_t> delay) { first_ = delay; }
  /// Delay of a packet. How many more were late than at the last one.
  std::uint32_t note(std::optional<std::uint32_t> delay);
  void replied() { ++replies_; }

  std::optional<std::uint32_t> last() const { return last_; }
  bool counts() const { return counts_; }  ///< it was seen to grow: the controller wires it
  std::uint64_t replies() const { return replies_; }
  /// Every reply of this session counts as late, but for those under way; of at least `replies`.
  bool refused(std::uint64_t replies) const;

 private:
  std::optional<std::uint32_t> first_, last_;
  std::uint64_t replies_ = 0;
  bool counts_ = false;
};

}  // namespace cellcal::drivers
