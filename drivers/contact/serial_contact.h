#pragma once
// The contact sensor on a real port. The protocol runs on the robot's io_context; the port is read
// and written on other threads.
//
// Threads: the ContactSensor functions are for the session. guard() is for that io_context's thread
// only. Two threads transfer bytes between the port and lock-free queues, a third, idle
// unless the port was lost, opens and closes devices (port_keeper). The io_context's thread never
// accesses the port and cannot be blocked by it.

#include <boost/asio/io_context.hpp>
#include <cstdint>
#include <memory>
#include <optional>

#include "drivers/contact.h"
#include "drivers/contact/contact_core.h"
#include "drivers/contact/port/port.h"
#include "drivers/contact/wire/ctp_codec.h"
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

// A contact sensor in one thread and in virtual time: the unmodified core on a ByteLine.

class ContactInline : public ContactSensor {
 public:
  /// Both must outlive this object.
  ContactInline(const ContactOptions& options, const Clock& clock, ByteLine& line);

  void open() override;
  ContactStatus status() const override;
  void arm(std::uint16_t arm_id, std::chrono::milliseconds lifetime) override;
  std::optional<ArmResult> poll_arm() override;
  void disarm() override;
  void self_test() override;
  std::optional<ContactRecord> next_record() override { return core_.next_record(); }
  void close() override;

  /// Runs line and core until t, in chronological order. The owner of the virtual clock calls this
  /// with its new time, before the robot's cycle uses guard().
  void run_until(TimePoint t);
  ContactGuard& guard() { return core_; }

 private:
  const Clock& clock_;
  ByteLine& line_;
  ContactCore core_;
  TimePoint now_{};         ///< time up to which everything has run
  TimePoint write_time_{};  ///< transmission time of the core's current output
  bool open_ = false;
};

}  // namespace cellcal::drivers
