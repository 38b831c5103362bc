#pragma once
// Publishes to the controller what the checks say, and again: once more where it did not acknowledge it, behind each
// session, and twice a day. On a thread of its own; nothing moves by it, and no session waits for it longer than for the doctor.

#include <condition_variable>
#include <functional>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <thread>

#include "daemon/controller/advice.h"
#include "drivers/kuka/eki/eki_frames.h"

namespace cellcal::daemon {

struct AdviceStatus {
  bool configured = false;
  std::optional<Advice> acknowledged;  ///< the newest that the controller has read back
  std::string acknowledged_at;         ///< ISO 8601 UTC
  std::string
      trouble;  ///< why the newest was not acknowledged, and what to do; empty: it was, or waits for its turn
};

class AdvicePublisher {
 public:
  /// One telegram to the controller and its answer; some ten seconds at most.
  using Send = std::function<drivers::EkiFrameResult(const drivers::EkiFrameRequest&,
                                                     const std::stop_token& stop)>;
  struct Parts {
    std::function<PublishedAdvice()> current;
    /// As the configuration says now; null: nothing is published.
    std::function<Send()> send;
    /// Does it while no session runs. False: one does, and nothing was done.
    std::function<bool(const std::function<void()>&)> alone;
    std::function<std::string()> utc_now;
  };
  explicit AdvicePublisher(Parts parts) : parts_(std::move(parts)) {}
  ~AdvicePublisher() { stop(); }
  AdvicePublisher(const AdvicePublisher&) = delete;
  AdvicePublisher& operator=(const AdvicePublisher&) = delete;

  void start();
  /// A session has ended, another calibration is in use, the configuration is another. Waits for nothing.
  void poke();
  /// At once, also in the midst of a telegram.
  void stop();
  AdviceStatus status() const;

  /// One look, as the thread takes it: sends what is due. Returns how long to wait for the next.
  drivers::Duration look(drivers::TimePoint now);

 private:
  void run();
  /// Empty: the controller has it.
  std::string publish(const PublishedAdvice& advice, const Send& send);

  Parts parts_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  bool poked_ = false;
  std::stop_source stop_;
  AdviceStatus status_;
  std::optional<PublishedAdvice> confirmed_;  ///< of the controller, by what it read back
  std::optional<PublishedAdvice> failed_;     ///< what the newest failure was about
  drivers::TimePoint confirmed_at_{}, not_before_{};
  drivers::Duration pause_{};
  std::thread thread_;
};

}  // namespace cellcal::daemon
