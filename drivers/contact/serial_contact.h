#pragma once
// The contact sensor on a real port. All of the protocol runs on the robot's io_context.
//
// Threads: the ContactSensor calls are the session's. guard() is for that io_context's thread only.
// A third thread, sleeping unless the port was lost, opens and closes devices: both can block for
// longer than the robot's cycle lasts. Between session and io thread there are lock-free queues.

#include <boost/asio/io_context.hpp>
#include <memory>

#include "drivers/contact.h"
#include "drivers/contact/contact_core.h"
#include "drivers/contact/serial_port.h"

namespace cellcal::drivers {

struct SerialContactOptions {
  SerialPortOptions port;
  ContactOptions contact;  ///< its baud is taken from port
  std::chrono::milliseconds reopen_first{100}, reopen_longest{2000};
};

class SerialContact : public ContactSensor {
 public:
  SerialContact(boost::asio::io_context& io, const SerialContactOptions& options);
  /// The io_context must be running, or have been stopped for good.
  ~SerialContact() override;

  void open() override;
  ContactStatus status() const override;
  void arm(std::uint16_t arm_id, std::chrono::milliseconds lifetime) override;
  std::optional<ArmResult> poll_arm() override;
  void disarm() override;
  void self_test() override;
  void close() override;

  /// For the robot's cycle, on the io_context's thread; lives as long as this object. Looks at the
  /// port itself, so that what has arrived counts in this cycle. A trip uses its arming up: take
  /// the events before judging snapshot().armed.
  ContactGuard& guard();

 private:
  class Impl;
  std::shared_ptr<Impl> impl_;
};

}  // namespace cellcal::drivers
