#pragma once
// The contact sensor on a real port. All of the protocol runs on the robot's io_context; the port
// itself is read and written elsewhere.
//
// Threads: the ContactSensor calls are the session's. guard() is for that io_context's thread only.
// Two threads carry bytes between the port and lock-free queues (port_pump), a third, sleeping
// unless the port was lost, opens and closes devices (port_keeper). Nothing that the io_context's
// thread does here can make it wait: it never touches the port.

#include <boost/asio/io_context.hpp>
#include <memory>

#include "drivers/contact.h"
#include "drivers/contact/contact_core.h"
#include "drivers/contact/port/port.h"
#include "drivers/io_thread.h"

namespace cellcal::drivers {

struct SerialContactOptions {
  PortOptions port;
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
  std::optional<ContactRecord> take_record() override;
  void close() override;

  /// For the robot's cycle, on the io_context's thread; lives as long as this object. Takes what
  /// the port's reader has queued, so that what has arrived counts in this cycle. A trip uses its
  /// arming up: take the events before judging snapshot().armed.
  ContactGuard& guard();

 private:
  class Impl;
  std::shared_ptr<Impl> impl_;
};

}  // namespace cellcal::drivers
