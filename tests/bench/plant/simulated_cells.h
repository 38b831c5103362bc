#pragma once
// Cells that only talk: each an MQTT connection of its own that publishes touches, all in one thread.

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

namespace cellcal::bench {

/// A touch as a cell says it, with the time of now. Cells and numbers from 1.
std::string touch_message(std::size_t cell, std::int64_t number, std::int64_t session);
/// Its topic.
std::string touch_topic(std::size_t cell);

class SimulatedCells {
 public:
  /// All are connected. Throws std::runtime_error.
  SimulatedCells(std::uint16_t port, std::size_t count);
  ~SimulatedCells();
  SimulatedCells(const SimulatedCells&) = delete;
  SimulatedCells& operator=(const SimulatedCells&) = delete;

  /// Each publishes so many as fast as the broker takes them; returns when all are acknowledged.
  void publish_all(std::size_t each, std::int64_t session);
  /// So many a second of all together, in turn, for so long.
  void publish_paced(double per_second, double seconds, std::int64_t session);

  struct Impl;

 private:
  std::unique_ptr<Impl> impl_;
};

}  // namespace cellcal::bench
