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

void EkiWire::exchange(Controller& controller, Robot& robot, Nothing, drivers::TimePoint now) {
  if (robot.wants_close() && controller.connected()) {
    controller.disconnect();
    robot.on_closed(now);
  } else if (robot.wants_connection() && controller.connect()) {
    robot.on_connected(now);
  }
  robot.on_bytes(controller.drain_output(), now);
  robot.on_tick(now);
  controller.receive(robot.output());
  robot.sent(robot.output().size());
}

}  // namespace cellcal::daemon
