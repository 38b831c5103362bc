#pragma once
// A contact sensor in one thread and in virtual time: the unmodified core on a ByteLine.

#include <cstdint>
#include <optional>

#include "drivers/contact.h"
#include "drivers/contact/contact_core.h"
#include "drivers/contact/wire/ctp_codec.h"

namespace cellcal::drivers {

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
