#pragma once
// Position of the arm, as sent by the controller's submit program to every EKI client: for teaching by the
// pendant, in T1, with any robot program selected. Nothing is sent, no session is started, nothing moves.

#include <optional>

#include "drivers/kuka/eki/eki_aside.h"
#include "drivers/kuka/wire/eki_framer.h"

namespace cellcal::drivers {

enum class EkiPositionTrouble {
  kNone,
  kNoConnection,
  kNoState,    ///< connected, but no readable state
  kInSession,  ///< the controller obeys a session
  kMoves,      ///< the arm is not at rest
  kClosed,
  kNotAStream,
};

struct EkiPosition {
  EkiPositionTrouble trouble = EkiPositionTrouble::kNone;
  AxisAngles axes_deg;  ///< measured, A1 to A6 and external axes; kNone
  std::string peer;     ///< "172.31.1.147:54600"
  std::string detail;   ///< kNoConnection: the system's error message
};

class EkiPositionReading : public EkiAside {
 public:
  explicit EkiPositionReading(TimePoint connected) : begun_(connected) {}

  void on_bytes(std::string_view bytes, TimePoint now) override;
  void on_tick(TimePoint now) override;
  void on_closed() override { end(EkiPositionTrouble::kClosed); }
  std::string drain_output() override { return {}; }
  bool ended() const override { return result_.has_value(); }
  const std::optional<EkiPosition>& result() const { return result_; }

 private:
  void end(EkiPositionTrouble why);

  EkiFramer framer_;
  EkiParser parser_;
  EkiState state_;
  EkiRest rest_;
  TimePoint begun_, heard_at_{};
  EkiPositionTrouble in_the_way_ = EkiPositionTrouble::kNoState;
  std::optional<EkiPosition> result_;
};

/// Over TCP, in the calling thread; retried according to `limits` if the controller accepts no client. Throws
/// DriverError if `address` is not an IP address.
EkiPosition read_position(const std::string& address, std::uint16_t port,
                          const EkiReconnectLimits& limits = {});

}  // namespace cellcal::drivers
