#pragma once
// A proxy before a broker that can send further bytes to clients, and that, like some brokers, ends the connection of a client that sends a larger packet than permitted, with the MQTT 5 reason 0x95
// and without announcing a limit.

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

namespace cellcal::daemon::testing {

class StrictListener {
 public:
  StrictListener(std::uint16_t broker, std::size_t most_bytes);
  ~StrictListener();
  StrictListener(const StrictListener&) = delete;
  StrictListener& operator=(const StrictListener&) = delete;

  std::uint16_t port() const;
  /// From now on packets of any size pass. Open connections are ended, as by a restart of the broker.
  void accept_all();
  int ended() const;  ///< connections, for a packet that was too large
  /// Sends to all open connections, between packets of the broker, which must be idle.
  void say(const std::string& bytes);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace cellcal::daemon::testing
