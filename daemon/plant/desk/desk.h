#pragma once
// The daemon's side of the connection to the plant process: permitted requests and their answers. That
// process is not trusted: beyond the effects listed in this module's README.md its requests move, begin and
// change nothing.

#include <chrono>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/api/http/http.h"
#include "daemon/config/network_config.h"
#include "daemon/files/log_context.h"
#include "daemon/plant/line/edge_node.h"
#include "daemon/plant/line/line_status.h"
#include "daemon/plant/messages/fact.h"
#include "daemon/plant/messages/presence.h"

namespace cellcal::daemon::plant {

// Messages between the daemon and the plant process, as JSON. Both validate the other's messages like foreign
// input: all functions throw calib::FileError.

/// From the daemon, every second: the configured line, and the state of the cell.
struct Orders {
  std::string daemon{};  ///< id of the answering daemon: another one may have another journal
  std::optional<PlantConfig> plant{};  ///< the part that a line needs; none: no plant configured
  bool mock = false;                   ///< emulated cell
  std::vector<sparkplug::Metric> metrics{};  ///< empty: disabled
};

/// Maximum size of a request, and of the rows that it acknowledges.
inline constexpr std::size_t kMostDeskBody = std::size_t{1} << 19, kMostDeskRows = 1000;

std::string to_json(const Orders& orders);
Orders orders_from_json(std::string_view json);

std::string to_json(const LinesStatus& lines);
LinesStatus lines_from_json(std::string_view json);

std::string to_json(const WaitingCount& count);
WaitingCount count_from_json(std::string_view json);

/// Two lines each: description, and the unmodified message.
std::string to_lines(const std::vector<WaitingFact>& facts);
std::vector<WaitingFact> facts_from_lines(std::string_view lines);

std::string rows_to_json(const std::vector<std::int64_t>& rows);
std::vector<std::int64_t> rows_from_json(std::string_view json);

/// The process reports its status every second; after this silence it counts as stopped.
inline constexpr std::chrono::seconds kDeskSilence{10};
/// Limit per minute; further proposals remain at the broker until the line is reopened.
inline constexpr int kMostProposals = 60;

class Desk {
 public:
  using Time = std::chrono::steady_clock::time_point;
  struct Parts {
    std::function<Time()> now = [] { return std::chrono::steady_clock::now(); };
    std::function<std::string()> utc;
    /// Handles a proposal of the plant; true: answered.
    std::function<bool(const Proposal&)> proposal;
    /// State of the cell as metrics, where enabled.
    std::function<std::vector<sparkplug::Metric>()> metrics;
    /// Called periodically while the process is running.
    std::function<void()> publish_health;
  };
  explicit Desk(Parts parts);

  /// Applies from now on; null: no plant configured.
  void use(std::shared_ptr<Outbox> outbox, std::optional<PlantConfig> plant, bool mock);

  /// From one thread.
  Response answer(const Request& request);

  /// Thread-safe. None: no plant configured.
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
  OccurrenceLimit refused_, unread_;
  std::vector<sparkplug::Metric> metrics_;  ///< newest readable state
  Time proposals_since_{}, health_at_{};
  int proposals_ = 0;

  mutable std::mutex mutex_;  ///< guards the members below; held briefly
  Now now_;
  std::optional<LinesStatus> heard_;
  Time heard_at_;
  std::string heard_utc_;
};

// Client of the daemon in the process with the line to the plant.

/// Reports the status of the lines and returns the current orders. Throws SocketError where no daemon
/// answers, OutboxError for an unexpected answer.
Orders report_to_desk(const std::filesystem::path& socket, const LinesStatus& lines);

/// Outbox of a cell of this name. From one thread.
class DeskClient final : public Outbox {
 public:
  DeskClient(std::filesystem::path socket, const PlantConfig& as);

  WaitingCount count() override;
  std::vector<WaitingFact> facts(std::int64_t after, std::size_t most) override;
  void acknowledge(const std::vector<std::int64_t>& rows) override;
  /// True if the proposal is answered. Throws OutboxError.
  bool propose(const Proposal& proposal);

 private:
  std::filesystem::path socket_;
  std::string as_;  ///< as a query parameter
};

}  // namespace cellcal::daemon::plant
