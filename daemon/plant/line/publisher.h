#pragma once
// Publishes pending facts to the plant's broker, on its own thread; callers never block.

#include <chrono>
#include <functional>
#include <memory>

#include "daemon/config/network_config.h"
#include "daemon/plant/line/line_status.h"
#include "daemon/plant/messages/fact.h"
#include "daemon/plant/messages/presence.h"

namespace cellcal::daemon::plant {

class Publisher {
 public:
  struct Parts {
    Outbox& outbox;  ///< called on this object's thread
    PlantConfig config;
    bool mock = false;  ///< emulated cell
    /// Handles a proposal of the plant; true: answered, to be removed from the broker. Called on this
    /// object's thread.
    std::function<bool(const Proposal&)> proposal = {};
    std::chrono::milliseconds first_wait{1000},
        longest_wait{60000};  ///< delay before a line is reopened
    std::chrono::milliseconds refused_wait{60000};
    std::chrono::milliseconds journal_wait{5000};  ///< delay after a disk error
    std::chrono::milliseconds stored_wait{
        600000};  ///< time for the plant to store a result, after which it is sent again
    /// Limit of results at the broker that are not stored; no more are sent.
    std::size_t most_unstored = 256;
    std::chrono::milliseconds farewell{2000};
    std::chrono::seconds keepalive{30};
  };
  explicit Publisher(Parts parts);
  /// Orderly, as far as the broker answers.
  ~Publisher();
  Publisher(const Publisher&) = delete;
  Publisher& operator=(const Publisher&) = delete;

  /// The outbox may contain new facts. Thread-safe.
  void poke();
  /// Ends as a lost line: the broker publishes the will to the plant.
  void close_with_will();
  LineStatus status() const;
  const PlantConfig& config() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace cellcal::daemon::plant
