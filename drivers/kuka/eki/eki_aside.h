#pragma once
// What is asked of the controller beside a session, over a connection of its own that says no hello: nobody is
// obeyed by it and nothing moves. The channel takes one client: while a session holds it there is no such
// connection, and while this one stands no session can begin.

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
  /// To be sent, all of it, once.
  virtual std::string take_output() = 0;
  virtual bool ended() const = 0;
};

/// Whether the arm stands: within 0.01 deg for 0.3 s, as the controller looks at it itself.
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
  /// Throws DriverError where `address` is no IP address. `stop`: connecting and running end within 20 ms, as closed.
  EkiAsideLine(const std::string& address, std::uint16_t port, std::stop_token stop = {});
  ~EkiAsideLine();
  EkiAsideLine(const EkiAsideLine&) = delete;
  EkiAsideLine& operator=(const EkiAsideLine&) = delete;

  /// Anew, within 3 s. Empty, or why not in the system's words. Reaches nothing but this address.
  std::string connect();
  /// Until it has ended; its own limits see to that.
  void run(EkiAside& aside);
  /// "172.31.1.147:54600"
  std::string peer() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

inline constexpr Duration kEkiReopenPause = std::chrono::milliseconds(100);

struct EkiReconnectLimits {
  /// The controller opens its port again a moment after a client has gone, and may take a connection and close it at
  /// once until then; of a client whose cable was pulled it knows after its own 10 s. So long a new client tries.
  Duration reopens_within = std::chrono::seconds(12);
  std::stop_token stop = {};
};

}  // namespace cellcal::drivers
