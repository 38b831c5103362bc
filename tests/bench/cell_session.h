#pragma once
// The drivers as in the daemon's RSI backend (SerialContact on a terminal, RsiRobot on UDP, both on
// one IoThread), with searches as in a session, against a CellPeer.

#include <boost/asio/io_context.hpp>
#include <chrono>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <thread>

#include "drivers/contact/serial_contact.h"
#include "drivers/io_thread.h"
#include "drivers/kuka/rsi/rsi_robot.h"
#include "tests/bench/cell_peer.h"

namespace cellcal::bench {

struct CellSessionOptions {
  double speed_mrad_s = 2.0;  ///< of the searching axis: 2 mm/s at 1 m of reach
  bool realtime = true;
  bool patient = false;  ///< a stall of the machine is no failure of robot or clock
};

/// Polls every millisecond until the condition is true, for at most 10 s.
template <typename Condition>
bool eventually(Condition done) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds{10};
  while (!done()) {
    if (std::chrono::steady_clock::now() > end) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds{1});
  }
  return true;
}

class CellSession {
 public:
  /// Opens all devices and starts the peer, which must outlive this.
  CellSession(CellPeer& peer, const CellSessionOptions& options);
  ~CellSession();
  CellSession(const CellSession&) = delete;
  CellSession& operator=(const CellSession&) = delete;

  /// Empty, or the reason why it is not ready.
  std::string wait_until_ready();
  /// One search during which the sensor falls silent.
  std::optional<Silence> lose_heartbeat();
  /// One search that ends in contact. Empty: failed; the reason is counted.
  std::optional<Contact> search(std::optional<drivers::Duration> gap);

  const std::map<std::string, int>& spoilt() const { return spoilt_; }
  bool realtime() const { return options_.realtime && io_.warnings().empty(); }
  boost::asio::io_context& context() { return io_.context(); }

 private:
  /// Empty: it did not begin, or did not end.
  std::optional<drivers::MoveResult> search_with(const std::function<void()>& what_happens);
  std::nullopt_t spoiled(const std::string& why);

  const CellSessionOptions options_;
  CellPeer& peer_;
  drivers::IoThread io_;  // in this order: users of the context are destroyed first
  drivers::SerialContact contact_;
  drivers::RsiRobot robot_;
  std::uint16_t arm_id_ = 0;
  std::uint32_t move_id_ = 0;
  bool forth_ = false;
  std::map<std::string, int> spoilt_;
};

}  // namespace cellcal::bench
