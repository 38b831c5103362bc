#pragma once
// The cell as a Sparkplug B edge node on the plant's broker. Its thread; nobody waits for it.

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
    /// How the cell stands: always the same names in the same order; empty: not known yet. On this thread.
    std::function<std::vector<Metric>()> look;
    std::chrono::milliseconds every{1000};  ///< it is looked, and births are asked for at most
    std::chrono::milliseconds first_wait{1000},
        longest_wait{60000};  ///< until a line is opened again
    std::chrono::milliseconds farewell{2000};
    std::chrono::seconds keepalive{30};
  };
  explicit EdgeNode(Parts parts);
  /// In order, as far as the broker is there.
  ~EdgeNode();
  EdgeNode(const EdgeNode&) = delete;
  EdgeNode& operator=(const EdgeNode&) = delete;

  /// Its end is that of a line that is lost: the broker says so to the host.
  void leave_without_a_farewell();
  /// `acknowledged`: births and data that went out.
  LineStatus status() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace cellcal::daemon::plant::sparkplug
