#pragma once
// The cell's daemon towards the process that has its line to the plant: what that may ask, and what it is given. It may be wrong, or
// in a stranger's hands: nothing it says moves, begins or changes more than what README.md of this room says.

#include <chrono>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "daemon/api/http/message.h"
#include "daemon/files/seldom.h"
#include "daemon/plant/desk/desk_words.h"
#include "daemon/plant/messages/outbox.h"
#include "daemon/plant/messages/proposal.h"

namespace cellcal::daemon::plant {

/// The process says each second how its line stands; beyond that it is not running.
inline constexpr std::chrono::seconds kDeskSilence{10};
/// Of proposals, each minute: beyond that they are left at the broker, until the line is opened anew.
inline constexpr int kMostProposals = 60;

class Desk {
 public:
  using Time = std::chrono::steady_clock::time_point;
  struct Parts {
    std::function<Time()> now = [] { return std::chrono::steady_clock::now(); };
    std::function<std::string()> utc;
    /// What the plant proposes; true: it is answered.
    std::function<bool(const Proposal&)> proposal;
    /// How the cell stands, where the plant is told of that as metrics.
    std::function<std::vector<sparkplug::Metric>()> metrics;
    /// Asked for every so often, while there is a process.
    std::function<void()> tell_health;
  };
  explicit Desk(Parts parts);

  /// From now on; null: no plant is named.
  void use(std::shared_ptr<Outbox> outbox, std::optional<PlantConfig> plant, bool mock);

  /// One thread.
  Response answer(const Request& request);

  /// Any thread. None: no plant is named.
  std::optional<LinesStatus> status() const;

 private:
  struct Now {
    std::shared_ptr<Outbox> outbox;
    std::optional<PlantConfig> plant;
    bool mock = false;
  };
  Now now() const;
  void sign_of_life();
  Response hear(const Request& request, const Now& now);
  Response take(const Request& request, const Now& now);

  Parts parts_;
  std::string born_;
  Seldom refused_, unread_;
  std::vector<sparkplug::Metric> metrics_;  ///< as they could be read last
  Time proposals_since_{}, health_at_{};
  int proposals_ = 0;

  mutable std::mutex mutex_;  ///< of what follows; held for no time
  Now now_;
  std::optional<LinesStatus> heard_;
  Time heard_at_;
  std::string heard_utc_;
};

}  // namespace cellcal::daemon::plant
