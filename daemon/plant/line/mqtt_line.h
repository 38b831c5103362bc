#pragma once
// One connection to a broker, from its opening to its loss; libmosquitto on an io_context of one thread. Nothing blocks; the resolver is
// waited for on a thread that nobody waits for.

#include <algorithm>
#include <boost/asio/io_context.hpp>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include "daemon/config/plant_config.h"
#include "daemon/plant/line/line_status.h"

namespace cellcal::daemon::plant {

struct LineFailure {
  LineProblem problem = LineProblem::kNone;
  std::string words;
};

/// A message that this line will not carry.
struct NotPublished : std::runtime_error {
  NotPublished(LineProblem why, const std::string& words)
      : std::runtime_error(words), problem(why) {}
  LineProblem problem;
};

class MqttLine {
 public:
  enum class Delivery { kAtMostOnce, kAtLeastOnce };
  struct Message {
    std::string topic, payload;
    bool retained = false;
    Delivery delivery = Delivery::kAtLeastOnce;  ///< kAtMostOnce: answered once it is on its way
  };
  /// Called from the io_context, never from within a call of this.
  struct Events {
    std::function<void()> up;
    /// None: taken.
    std::function<void(int message, std::optional<LineFailure> refused)> answered;
    /// Of what listen() asked for. Anybody may have said it.
    std::function<void(const std::string& topic, const std::string& payload)> heard;
    /// Once; nothing comes after it.
    std::function<void(const LineFailure&)> down;
  };
  struct Times {
    std::chrono::seconds keepalive{30};  ///< lost when nothing is heard for one and a half
    std::chrono::seconds opening{30};
  };

  /// Opens it; what comes of that is told by the events. Without a will it is nobody's line: the broker gives it a name. `role`: which
  /// of the cell's lines this is, for its client id.
  MqttLine(boost::asio::io_context& context, const PlantConfig& config,
           const std::optional<Message>& will, Events events, Times times,
           const std::string& role = {});
  ~MqttLine();
  MqttLine(const MqttLine&) = delete;
  MqttLine& operator=(const MqttLine&) = delete;

  /// Its number. Throws NotPublished.
  int publish(const Message& message);
  /// Once it is up. What is not allowed is not heard, and nobody says so.
  void listen(const std::vector<std::string>& filters);
  /// Bytes of the largest packet that the broker takes, as it said when the line was opened; none: it said nothing.
  std::optional<std::uint32_t> largest_packet() const;
  /// In order: the will is not sent. down() comes.
  void close();

 private:
  struct Impl;
  struct Handle;
  struct Door;
  std::shared_ptr<Impl> impl_;
};

// How long it is waited until a line that was lost is opened again.

/// Twice as long each time, up to the longest, and each between half and one and a half of that: a broker that starts again is not met
/// by all cells at once.
class Backoff {
 public:
  Backoff(std::chrono::milliseconds first, std::chrono::milliseconds longest)
      : first_(first), longest_(longest) {}

  std::chrono::milliseconds next() {
    wait_ = std::clamp(wait_ * 2, first_, longest_);
    const double share = std::uniform_real_distribution<double>(0.5, 1.5)(chance_);
    return std::chrono::duration_cast<std::chrono::milliseconds>(wait_ * share);
  }
  /// The line was good for something.
  void reset() { wait_ = {}; }
  /// Trying at once is of no use.
  void exhaust() { wait_ = longest_; }

 private:
  std::chrono::milliseconds first_, longest_, wait_{0};
  std::minstd_rand chance_{std::random_device{}()};
};

}  // namespace cellcal::daemon::plant
