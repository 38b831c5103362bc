#pragma once
// The contact sensor on a real port. The protocol runs on the robot's io_context; the port is read
// and written on other threads.
//
// Threads: the ContactSensor functions are for the session. guard() is for that io_context's thread
// only. Two threads transfer bytes between the port and lock-free queues, a third, idle
// unless the port was lost, opens and closes devices (port_keeper). The io_context's thread never
// accesses the port and cannot be blocked by it.

#include <boost/asio/io_context.hpp>
#include <memory>

#include "drivers/contact.h"
#include "drivers/contact/contact_core.h"
#include "drivers/contact/port/port.h"
#include "drivers/io_thread.h"

namespace cellcal::drivers {

struct SerialContactOptions {
  PortOptions port;
  ContactOptions contact;  ///< its baud is taken from `port`
  std::chrono::milliseconds reopen_first{100}, reopen_longest{2000};
};

class SerialContact : public ContactSensor {
 public:
  SerialContact(boost::asio::io_context& io, const SerialContactOptions& options);
  /// The io_context must be running, or have been stopped permanently.
  ~SerialContact() override;

  void open() override;
  ContactStatus status() const override;
  void arm(std::uint16_t arm_id, std::chrono::milliseconds lifetime) override;
  std::optional<ArmResult> poll_arm() override;
  void disarm() override;
  void self_test() override;
  std::optional<ContactRecord> next_record() override;
  void close() override;

  /// For the robot's cycle, on the io_context's thread; valid for the lifetime of this object.
  /// Processes data queued by the port's reader, so that it counts in this cycle. A trip ends its
  /// arming: read the events before evaluating snapshot().armed.
  ContactGuard& guard();

 private:
  class Impl;
  std::shared_ptr<Impl> impl_;
};

}  // namespace cellcal::drivers
