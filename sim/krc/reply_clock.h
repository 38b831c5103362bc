#pragma once
// From a packet's way out of the emulated controller to its reply's way in, by the kernel's own
// time stamps: what a real controller would see, whatever this process was doing meanwhile.

#include <sys/types.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

namespace cellcal::sim {

class ReplyClock {
 public:
  /// Asks for time stamps of what the socket receives.
  void watch(int socket);
  /// Just before the packet is sent.
  void sent(std::string_view packet);
  /// recv() on that socket, with the reply's time noted.
  ssize_t receive(int socket, std::span<char> into);

  struct Figures {
    std::size_t replies = 0;
    double median_ms = 0.0, p99_ms = 0.0, worst_ms = 0.0;
  };
  Figures figures() const;

 private:
  struct Sent {
    std::uint64_t ipoc = 0;
    std::int64_t ns = 0;
  };
  static constexpr std::size_t kKept = 256;  ///< replies later than this many packets are not seen
  static constexpr std::size_t kMost = 1'000'000;

  std::array<Sent, kKept> sent_{};
  std::size_t next_ = 0;
  std::vector<float> ms_;
};

}  // namespace cellcal::sim
