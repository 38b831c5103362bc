#pragma once
// One connection to a broker, from opening to loss: libmosquitto on an io_context of one thread. Never
// blocks; the resolver runs on a detached thread.

#include <algorithm>
#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <random>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "daemon/config/network_config.h"
#include "daemon/files/log_context.h"
#include "daemon/plant/line/line_status.h"

namespace cellcal::daemon::plant {

struct LineFailure {
  LineProblem problem = LineProblem::kNone;
  std::string words;
};

/// The message cannot be carried by this line.
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
    Delivery delivery = Delivery::kAtLeastOnce;  ///< kAtMostOnce: acknowledged once sent
  };
  /// Called from the io_context, never from within a call of this object.
  struct Events {
    std::function<void()> up;
    /// None: accepted.
    std::function<void(int message, std::optional<LineFailure> refused)> answered;
    /// Message of a subscription. The sender is unverified.
    std::function<void(const std::string& topic, const std::string& payload)> heard;
    /// Once, as the last event.
    std::function<void(const LineFailure&)> down;
  };
  struct Times {
    std::chrono::seconds keepalive{30};  ///< lost after silence of one and a half times this
    std::chrono::seconds opening{30};
  };

  /// Opens the connection; the result is reported by the events. Without a will it is anonymous: the broker
  /// assigns the client id. `role`: which of the cell's lines this is, for the client id.
  MqttLine(boost::asio::io_context& context, const PlantConfig& config,
           const std::optional<Message>& will, Events events, Times times,
           const std::string& role = {});
  ~MqttLine();
  MqttLine(const MqttLine&) = delete;
  MqttLine& operator=(const MqttLine&) = delete;

  /// Returns the message's number. Throws NotPublished.
  int publish(const Message& message);
  /// Once connected. The broker silently ignores forbidden filters.
  void listen(const std::vector<std::string>& filters);
  /// Size limit of packets [bytes] announced by the broker; none: not announced.
  std::optional<std::uint32_t> largest_packet() const;
  /// Orderly: the will is not sent. down() follows.
  void close();

 private:
  struct Impl;
  struct Handle;
  struct OpeningGuard;
  std::shared_ptr<Impl> impl_;
};

// Delay before a lost line is reopened.

/// Doubles each time up to a limit, randomised between 0.5 and 1.5 times, so that a restarted broker is not
/// contacted by all cells at once.
class Backoff {
 public:
  Backoff(std::chrono::milliseconds first, std::chrono::milliseconds longest)
      : first_(first), longest_(longest) {}

  std::chrono::milliseconds next() {
    wait_ = std::clamp(wait_ * 2, first_, longest_);
    const double share = std::uniform_real_distribution<double>(0.5, 1.5)(chance_);
    return std::chrono::duration_cast<std::chrono::milliseconds>(wait_ * share);
  }
  /// After a successful connection.
  void reset() { wait_ = {}; }
  /// An immediate retry cannot succeed.
  void exhaust() { wait_ = longest_; }

 private:
  std::chrono::milliseconds first_, longest_, wait_{0};
  std::minstd_rand chance_{std::random_device{}()};
};

// Two cells of one name end each other's lines without end. The reason code of MQTT 5 is not reliable:
// mosquitto 2.0.11 closes the older line before libmosquitto has read one. The evidence is a series of
// lines that are closed soon after login.

class Takeovers {
 public:
  using Time = std::chrono::steady_clock::time_point;

  void up(Time now) { up_ = now; }
  /// The failure of a line, as kTakenOver where it is one of a series of short ones. `of`: for the words.
  LineFailure judged(LineFailure failure, const PlantConfig& of, Time now);

 private:
  std::optional<Time> up_;
  int short_lines_ = 0;
};

/// "broker HOST:PORT: another cell uses this name, graz/weld-3. ..."
LineFailure taken_over(const PlantConfig& of);

// A line that is opened anew after each loss, on a thread of its own, until an orderly end.

/// start() and status_now() by the owner, all else on the thread of the context.
struct LineThread {
  LineThread(std::chrono::milliseconds first_wait, std::chrono::milliseconds longest_wait,
             const char* in_log)
      : backoff(first_wait, longest_wait), name_in_log(in_log) {}
  virtual ~LineThread() = default;

  virtual void connect() = 0;
  void start();
  void connect_later();
  /// After a login. True: it is to be logged.
  bool has_come_up();
  /// After a loss: the failure as kTakenOver where it is one of a series.
  LineFailure has_gone(const LineFailure& lost, const PlantConfig& of);
  /// Ends the thread where it stops, otherwise connects later.
  void go_on_after(const LineFailure& failure);
  /// Into the status and, as news, into the log.
  void say(const LineFailure& failure);
  /// True: the farewell is to be sent; the thread ends after `longest` at the latest. Otherwise it ends.
  bool begin_farewell(std::chrono::milliseconds longest);
  void set(const std::function<void(LineStatus&)>& change);
  LineStatus status_now() const;

  boost::asio::io_context context;
  boost::asio::steady_timer retry{context}, last{context};
  Backoff backoff;
  const char* name_in_log;
  Takeovers takeovers;
  std::unique_ptr<MqttLine> line;
  OccurrenceLimit connections;
  std::map<LineProblem, OccurrenceLimit> warnings;
  bool is_up = false, stopping = false;
  bool orderly = true;  ///< false: ends as a lost line, with the will
  mutable std::mutex status_mutex;
  LineStatus status;
  std::thread thread;
};

}  // namespace cellcal::daemon::plant
