#pragma once
// The emulated sensor in real time on a pseudo-terminal.

#include <string>

#include "sim/mcu/mcu_thread.h"

namespace cellcal::sim {

struct McuPtyOptions {
  McuOptions mcu;
  std::string symlink;  ///< second name of the terminal, replaced if it is a symlink; may be empty
  bool realtime = false;  ///< SCHED_FIFO, if permitted
};

/// Construction opens the terminal and starts the thread; throws std::system_error. Destruction
/// closes the master's end: for the driver, the sensor is unplugged.
class McuPty final : public McuThread {
 public:
  explicit McuPty(const McuPtyOptions& options);
  ~McuPty() override;

 private:
  void open_terminal();
  void link();
  int fd() const override { return master_.get(); }
  void read_host() override;
  bool write_host(const Microcontroller::Output& output) override;
  bool can_wait() override;
  void listen_as_the_host_does();

  const int baud_;
  int host_baud_ = baud_;
  std::string symlink_;
  Fd master_;
  bool operator_present_ = false;
};

}  // namespace cellcal::sim
