#pragma once
// Requests to the controller outside a session, over a separate connection without a hello: the controller
// obeys no client, and nothing moves. The channel takes one client: no such connection is possible during a
// session, and no session can begin during such a connection.

#include <cstdint>
#include <memory>
#include <stop_token>
#include <string>
#include <string_view>

#include "drivers/kuka/wire/eki_codec.h"
#include "drivers/time.h"

namespace cellcal::drivers {

/// Sans I/O: bytes in, bytes out.
class EkiAside {
 public:
  virtual ~EkiAside() = default;
  virtual void on_bytes(std::string_view bytes, TimePoint now) = 0;
  virtual void on_tick(TimePoint now) = 0;
  virtual void on_closed() = 0;
  /// Output to be sent completely, once.
  virtual std::string drain_output() = 0;
  virtual bool ended() const = 0;
};

/// Detects rest of the arm: within 0.01 deg for 0.3 s, the controller's own criterion.
class EkiRest {
 public:
  bool look(const EkiState& state, TimePoint now);

 private:
  AxisAngles rest_deg_;
  TimePoint since_{};
};

/// The connection, in the caller's thread.
class EkiAsideLine {
 public:
  /// Throws DriverError if `address` is not an IP address. `stop`: connecting and running end within 20 ms, as if
  /// closed.
  EkiAsideLine(const std::string& address, std::uint16_t port, std::stop_token stop = {});
  ~EkiAsideLine();
  EkiAsideLine(const EkiAsideLine&) = delete;
  EkiAsideLine& operator=(const EkiAsideLine&) = delete;

  /// Reconnects within 3 s. Returns an empty string, or the system's error message. Connects to
  /// this address only.
  std::string connect();
  /// Runs until `aside` has ended; its own time limits ensure that.
  void run(EkiAside& aside);
  /// "172.31.1.147:54600"
  std::string peer() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

inline constexpr Duration kEkiReopenPause = std::chrono::milliseconds(100);

struct EkiReconnectLimits {
  /// Retry period of a new client: the controller reopens its port shortly after a client has disconnected, and may
  /// accept and close a connection once until then; it detects a disconnected cable after 10 s.
  Duration reopens_within = std::chrono::seconds(12);
  std::stop_token stop = {};
};

}  // namespace cellcal::drivers
