#pragma once
// The emulated sensor in real time on a pseudo-terminal, on a thread of its own.

#include <functional>
#include <memory>
#include <string>

#include "sim/mcu/microcontroller.h"

namespace cellcal::sim {

struct McuPtyOptions {
  McuOptions mcu;
  std::string
      symlink;  ///< a second name for the terminal, replaced if it is a symlink; may be empty
  bool realtime = false;  ///< SCHED_FIFO, if permitted: a microcontroller has its own processor
};

/// Construction opens the terminal and starts the thread; throws std::system_error. Destruction
/// closes the master's end: to the driver, the sensor is unplugged. All calls are thread-safe.
class McuPty {
 public:
  explicit McuPty(const McuPtyOptions& options);
  ~McuPty();
  McuPty(const McuPty&) = delete;
  McuPty& operator=(const McuPty&) = delete;

  /// Path of the terminal's slave end, /dev/pts/N.
  const std::string& path() const;
  /// Steady-clock time of the edge, which may lie ahead.
  void edge(TimePoint t, bool closed);
  void set_faults(const McuFaults& faults);
  /// As Microcontroller::on_output, on the emulation's thread or that of edge().
  void on_output(Microcontroller::OnOutput callback);
  void reset(std::uint8_t cause = CTP_RESET_PIN);
  /// Runs on the calling thread with the emulation held still.
  void inspect(const std::function<void(const Microcontroller&)>& look) const;
  /// Frames that were thrown away because nobody read the terminal.
  std::uint64_t dropped() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace cellcal::sim
