#pragma once
// The other end of both wires, on one thread: the emulated controller on UDP, with its arm
// following, and the emulated contact sensor on a pseudo-terminal. It makes contacts on demand
// while the arm moves, and records the first reply whose correction no longer changes.

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "drivers/time.h"

namespace cellcal::bench {

struct PeerOptions {
  int cycle_ms = 4;
  std::uint64_t seed = 1;
  bool realtime = true;
};

/// A contact during a search.
struct Contact {
  drivers::Duration byte_to_packet{};    ///< TRIP written to the terminal -> next packet sent
  bool frozen_at_once = false;           ///< that packet itself was answered by a frozen reply
  drivers::Duration byte_to_frozen{};    ///< TRIP written -> first frozen reply seen
  drivers::Duration packet_to_frozen{};  ///< packet of that reply sent -> that reply seen
};

/// A sensor that fell silent during a search.
struct Silence {
  drivers::Duration to_frozen{};  ///< its last frame written -> first frozen reply seen
};

/// Since start().
struct PeerCounts {
  std::uint64_t packets = 0;
  std::uint64_t late = 0;    ///< packets that were not answered before the next one
  std::uint64_t stalls = 0;  ///< packets that the peer itself sent more than 1 ms late
};

/// Called by the session; in any order, except start() and stop().
class CellPeer {
 public:
  /// Opens the wires. Throws std::runtime_error.
  explicit CellPeer(const PeerOptions& options);
  ~CellPeer();
  CellPeer(const CellPeer&) = delete;
  CellPeer& operator=(const CellPeer&) = delete;

  const std::string& sensor_path() const;  ///< device of the contact sensor
  const std::string& echo_path() const;    ///< terminal of the bare echo
  std::uint16_t echo_port() const;         ///< destination of the bare echo

  /// RSI_ON, to the robot's port.
  void start(std::uint16_t robot_port);
  void stop();

  /// Contact as soon as the arm moves at constant speed. The TRIP is written at any time of the
  /// cycle; with `gap`, the next packet follows it by this gap.
  void touch(std::optional<drivers::Duration> gap);
  /// Times of the contact, once complete; touch() ends with them.
  std::optional<Contact> consume_contact();
  /// Silences the sensor at any time of the cycle once the arm moves at constant speed, until
  /// release().
  void fall_silent();
  std::optional<Silence> consume_silence();
  /// Ends a touch() without result, and opens the touch circuit.
  void release();

  /// Writes as many bytes as a TRIP has to the terminal of the echo, while nothing else happens.
  void ping_echo();
  /// Bytes written -> datagram seen.
  std::optional<drivers::Duration> consume_echo();

  bool realtime() const;  ///< requested and permitted
  PeerCounts counts() const;
  std::string pendant() const;  ///< message of a fault stop, after stop()

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace cellcal::bench
