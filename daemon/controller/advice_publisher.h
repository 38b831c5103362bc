#pragma once
// Publishes the result of the checks to the controller, and repeats it: where it was not acknowledged, after
// each session, and twice a day. Runs on a thread of its own; causes no motion, and delays a session no
// longer than the doctor does.

#include <condition_variable>
#include <functional>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <thread>

#include "calib/model/enum_table.h"
#include "calib/result/drift_chart.h"
#include "drivers/kuka/eki/eki_aside.h"

namespace cellcal::daemon {

// Result of the checks of the calibration in use as one number for robot programs: CELLCAL_ADVICE.

enum class Advice : int {
  kUnknown = 0,  ///< no calibration, no check of it, or too few checks and none for two weeks
  kHolds = 1,    ///< the newest check passed, and the control chart raises no objection
  kCheckAgain = 2,
  kLetItWarmUp = 3,
  kReMeasureTcp = 4,
  kRecalibrate = 5,
};
constexpr const char* to_string(Advice advice) { return own_name(advice); }

struct PublishedAdvice {
  Advice advice = Advice::kUnknown;
  int until_day = 0;  ///< kHolds: last day of publication, day_number(); otherwise 0
  bool operator==(const PublishedAdvice&) const = default;
};

/// YEAR*372+MONTH*31+DAY in UTC: increases from day to day, and a robot program computes it from $DATE.
/// `utc_s`: seconds since 1970.
int day_number(double utc_s);

/// From an aged chart (calib/check, age()). `now_s`: seconds since 1970, UTC.
PublishedAdvice advice_of(const calib::DriftChart& chart, double now_s);

struct AdviceStatus {
  bool configured = false;
  std::optional<Advice> acknowledged;  ///< the newest value that the controller has read back
  std::string acknowledged_at;         ///< ISO 8601 UTC
  /// Why the newest was not acknowledged, and the remedy; empty: acknowledged or pending.
  std::string trouble;
};

class AdvicePublisher {
 public:
  /// One telegram to the controller and its answer; about ten seconds at most.
  using Send = std::function<drivers::EkiFrameResult(const drivers::EkiFrameRequest&,
                                                     const std::stop_token& stop)>;
  struct Parts {
    std::function<PublishedAdvice()> current;
    /// By the current configuration; null: nothing is published.
    std::function<Send()> send;
    /// Runs the function while no session runs. Returns false without calling it where one does.
    std::function<bool(const std::function<void()>&)> alone;
    std::function<std::string()> utc_now;
  };
  explicit AdvicePublisher(Parts parts) : parts_(std::move(parts)) {}
  ~AdvicePublisher() { stop(); }
  AdvicePublisher(const AdvicePublisher&) = delete;
  AdvicePublisher& operator=(const AdvicePublisher&) = delete;

  void start();
  /// Signals the end of a session, another calibration in use or another configuration. Does not block.
  void poke();
  /// Immediate, also during a telegram.
  void stop();
  AdviceStatus status() const;

  /// One pass of the thread: sends what is due. Returns the wait until the next.
  drivers::Duration poll(drivers::TimePoint now);

 private:
  void run();
  /// Empty: acknowledged by the controller.
  std::string publish(const PublishedAdvice& advice, const Send& send);

  Parts parts_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  bool poked_ = false;
  std::stop_source stop_;
  AdviceStatus status_;
  std::optional<PublishedAdvice> confirmed_;  ///< value in the controller, as read back
  std::optional<PublishedAdvice> failed_;     ///< value of the newest failure
  drivers::TimePoint confirmed_at_{}, not_before_{};
  drivers::Duration pause_{};
  std::thread thread_;
};

}  // namespace cellcal::daemon
