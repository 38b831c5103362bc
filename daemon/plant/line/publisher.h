#pragma once
// What waits for the plant, to its broker. Its thread; nobody waits for it.

#include <chrono>
#include <functional>
#include <memory>

#include "daemon/config/plant_config.h"
#include "daemon/plant/line/line_status.h"
#include "daemon/plant/messages/outbox.h"
#include "daemon/plant/messages/proposal.h"

namespace cellcal::daemon::plant {

class Publisher {
 public:
  struct Parts {
    Outbox& outbox;  ///< asked on this thread
    PlantConfig config;
    bool mock = false;  ///< the cell is emulated
    /// What the plant proposes; true: it is answered, and may be taken away from the broker. On this thread.
    std::function<bool(const Proposal&)> proposal = {};
    std::chrono::milliseconds first_wait{1000},
        longest_wait{60000};  ///< until a line is opened again
    std::chrono::milliseconds refused_wait{60000};
    std::chrono::milliseconds journal_wait{5000};  ///< for the disk
    std::chrono::milliseconds stored_wait{
        600000};  ///< for the plant to have stored a result; then it is sent again
    std::size_t most_unstored =
        256;  ///< results that the broker has and nobody has stored; no more are sent
    std::chrono::milliseconds farewell{2000};
    std::chrono::seconds keepalive{30};
  };
  explicit Publisher(Parts parts);
  /// In order, as far as the broker is there.
  ~Publisher();
  Publisher(const Publisher&) = delete;
  Publisher& operator=(const Publisher&) = delete;

  /// There may be something new in the outbox. Any thread.
  void poke();
  /// Its end is that of a line that is lost: the broker says so to the plant.
  void leave_without_a_farewell();
  LineStatus status() const;
  const PlantConfig& config() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace cellcal::daemon::plant
