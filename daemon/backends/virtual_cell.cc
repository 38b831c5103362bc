#include "daemon/backends/virtual_cell.h"

namespace cellcal::daemon {

void RsiWire::exchange(Controller& controller, Robot& robot, std::string_view packet,
                       drivers::TimePoint now) {
  if (!packet.empty()) {
    const std::string_view reply = robot.on_datagram(packet, now);
    if (!reply.empty()) controller.receive(reply);
  }
  robot.on_tick(now);
}

}  // namespace cellcal::daemon
