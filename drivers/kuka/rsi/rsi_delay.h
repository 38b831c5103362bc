#pragma once
// Evaluates the controller's count of late replies (Delay): the number of late ones, and whether
// any reply is accepted. A wrong SENTYPE or IPOC is discarded without a message: only Delay shows
// it.

#include <cstdint>
#include <optional>

namespace cellcal::drivers {

class DelayWatch {
 public:
  /// Another session: its first packet becomes the reference.
  void begin_session();
  /// The first packet of a session that is answered; Delay, if sent.
  void begin_answers(std::optional<std::uint32_t> delay) { first_ = delay; }
  /// Delay of a packet. Returns the number of late replies since the last one.
  std::uint32_t note(std::optional<std::uint32_t> delay);
  void replied() { ++replies_; }

  std::optional<std::uint32_t> last() const { return last_; }
  bool counts() const { return counts_; }  ///< it has increased: the controller sends it
  std::uint64_t replies() const { return replies_; }
  /// True if every reply of this session, of at least `replies`, counts as late, except those in
  /// transit.
  bool refused(std::uint64_t replies) const;

 private:
  std::optional<std::uint32_t> first_, last_;
  std::uint64_t replies_ = 0;
  bool counts_ = false;
};

}  // namespace cellcal::drivers
