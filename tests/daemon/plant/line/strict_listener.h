#pragma once
// A listener before a broker, through which a test says more than the broker, and that ends the line of who sends a packet of more than so many bytes, with the reason 0x95 of MQTT 5 and without having
// announced a limit, as some brokers do.

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
  /// From now on packets of any size pass. Lines that are open are ended, as by a broker that starts again.
  void accept_all();
  int ended() const;  ///< lines, for a packet that was too large
  /// To all whose lines are open, between what the broker says: it must say nothing meanwhile.
  void say(const std::string& bytes);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace cellcal::daemon::testing
