#pragma once
// The cell as a Sparkplug B edge node on the plant's broker, on its own thread; callers never block.

#include <chrono>
#include <functional>
#include <memory>
#include <vector>

#include "daemon/config/plant_config.h"
#include "daemon/plant/line/line_status.h"
#include "daemon/plant/line/payload.h"

namespace cellcal::daemon::plant::sparkplug {

class EdgeNode {
 public:
  struct Parts {
    PlantConfig config;
    /// State of the cell: always the same names in the same order; empty: not known yet. Called on this
    /// object's thread.
    std::function<std::vector<Metric>()> look;
    /// Polling period, and minimum interval of births on request.
    std::chrono::milliseconds every{1000};
    std::chrono::milliseconds first_wait{1000},
        longest_wait{60000};  ///< delay before a line is reopened
    std::chrono::milliseconds farewell{2000};
    std::chrono::seconds keepalive{30};
  };
  explicit EdgeNode(Parts parts);
  /// Orderly, as far as the broker answers.
  ~EdgeNode();
  EdgeNode(const EdgeNode&) = delete;
  EdgeNode& operator=(const EdgeNode&) = delete;

  /// Ends as a lost line: the broker publishes the will to the host.
  void leave_without_a_farewell();
  /// `acknowledged`: number of births and data messages sent.
  LineStatus status() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace cellcal::daemon::plant::sparkplug
