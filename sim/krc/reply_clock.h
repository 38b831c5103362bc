#pragma once
// Time from sending a packet to receiving its reply, by the kernel's time stamps: as seen by a real
// controller, independent of this process' load.

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
  /// Requests time stamps for received data.
  void watch(int socket);
  /// To be called just before the packet is sent.
  void sent(std::string_view packet);
  /// recv() on that socket, recording the reply's time.
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
  static constexpr std::size_t kKept = 256;  ///< later replies are not matched
  static constexpr std::size_t kMost = 1'000'000;

  std::array<Sent, kKept> sent_{};
  std::size_t next_ = 0;
  std::vector<float> ms_;
};

}  // namespace cellcal::sim
