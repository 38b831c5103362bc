#pragma once
// Cells that only publish: each with its own MQTT connection, all in one thread.

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

namespace cellcal::bench {

/// The touch message of a cell, with the current time. Cells and numbers from 1.
std::string touch_message(std::size_t cell, std::int64_t number, std::int64_t session);
/// Its topic.
std::string touch_topic(std::size_t cell);

class SimulatedCells {
 public:
  /// Returns when all are connected. Throws std::runtime_error.
  SimulatedCells(std::uint16_t port, std::size_t count);
  ~SimulatedCells();
  SimulatedCells(const SimulatedCells&) = delete;
  SimulatedCells& operator=(const SimulatedCells&) = delete;

  /// Each publishes this many as fast as possible; returns when all are acknowledged.
  void publish_all(std::size_t each, std::int64_t session);
  /// This rate over all cells, in turn, for this duration.
  void publish_paced(double per_second, double seconds, std::int64_t session);

  struct Impl;

 private:
  std::unique_ptr<Impl> impl_;
};

}  // namespace cellcal::bench
