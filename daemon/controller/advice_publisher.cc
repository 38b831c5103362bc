#include "daemon/controller/advice_publisher.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>

#include "calib/check/charts.h"
#include "calib/check/drift.h"
#include "calib/model/enum_table.h"
#include "daemon/controller/frame_station.h"

namespace cellcal::daemon {

namespace {

using namespace std::chrono_literals;
using drivers::Duration;
using drivers::TimePoint;

constexpr Duration kPollInterval = 60s;  // kHolds also expires by the calendar
// The controller's files may have been reinstalled, or its data reset.
constexpr Duration kAgain = 12h;
constexpr Duration kBusy = 15s;  // a session runs; its end calls poke() as well
constexpr Duration kFirstPause = 60s, kLongestPause = 1h;

drivers::EkiFrameRequest request_of(const PublishedAdvice& advice) {
  return {drivers::EkiFrameKind::kAdvice, 1,
          drivers::EkiFrameValues{static_cast<double>(advice.until_day),
                                  static_cast<double>(static_cast<int>(advice.advice))}};
}

/// "CELLCAL_ADVICE: 3 sent, 1 read back", and the same for its last day.
std::string differs_words(const PublishedAdvice& sent, const drivers::EkiFrameValues& back) {
  return fmt::format(
      "CELLCAL_ADVICE: {} sent, {:.0f} read back; CELLCAL_ADVICE_UNTIL: {} sent, {:.0f} read back. "
      "Another program writes it: look for it on the pendant",
      static_cast<int>(sent.advice), back[1], sent.until_day, back[0]);
}

}  // namespace

std::string AdvicePublisher::publish(const PublishedAdvice& advice, const Send& send) {
  const drivers::EkiFrameResult result = send(request_of(advice), stop_.get_token());
  switch (result.end) {
    case drivers::EkiFrameEnd::kSet: return {};
    case drivers::EkiFrameEnd::kDiffers:
      return differs_words(advice, result.new_values.value_or(drivers::EkiFrameValues{}));
    case drivers::EkiFrameEnd::kRead:
    case drivers::EkiFrameEnd::kRefused:
    case drivers::EkiFrameEnd::kNotSent:
    case drivers::EkiFrameEnd::kUnknown: break;
  }
  if (result.refusal == drivers::EkiFrameDone::kNoSuchNumber ||
      result.trouble == drivers::EkiFrameTrouble::kTooOld)
    return "controller files without CELLCAL_ADVICE. Install those that 'cellcal kuka-files' "
           "writes with [eki] write_advice = true, then cold start";
  const std::string why = why_words(result);
  return why.empty() ? "the controller's answer could not be read" : why;
}

Duration AdvicePublisher::poll(TimePoint now) {
  const Send send = parts_.send();
  {
    const std::lock_guard lock(mutex_);
    status_.configured = static_cast<bool>(send);
    if (!send) {
      status_ = {};
      confirmed_.reset();
      failed_.reset();
      return kPollInterval;
    }
  }
  PublishedAdvice current;
  std::string trouble;
  try {
    current = parts_.current();
    const bool due = current != confirmed_ || now - confirmed_at_ >= kAgain;
    const bool may = current != failed_ || now >= not_before_;
    if (!due || !may) return kPollInterval;
    if (!parts_.alone([&] { trouble = publish(current, send); })) return kBusy;
  } catch (const std::exception& error) {
    trouble = error.what();
  }
  if (stop_.stop_requested()) return kPollInterval;
  const std::lock_guard lock(mutex_);
  if (trouble.empty()) {
    if (current != confirmed_)
      spdlog::info("CELLCAL_ADVICE sent: {} ({})", static_cast<int>(current.advice),
                   to_string(current.advice));
    confirmed_ = current;
    confirmed_at_ = now;
    failed_.reset();
    pause_ = {};
    status_.acknowledged = current.advice;
    status_.acknowledged_at = parts_.utc_now();
  } else {
    if (trouble != status_.trouble) spdlog::warn("CELLCAL_ADVICE not confirmed: {}", trouble);
    confirmed_.reset();  // the controller's current value is unknown
    failed_ = current;
    pause_ = std::clamp(2 * pause_, kFirstPause, kLongestPause);
    not_before_ = now + pause_;
  }
  status_.trouble = trouble;
  return kPollInterval;
}

AdviceStatus AdvicePublisher::status() const {
  const std::lock_guard lock(mutex_);
  return status_;
}

void AdvicePublisher::start() {
  thread_ = std::thread([this] { run(); });
}

void AdvicePublisher::run() {
  for (;;) {
    const Duration wait = poll(std::chrono::steady_clock::now());
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, wait, [this] { return poked_ || stop_.stop_requested(); });
    if (stop_.stop_requested()) return;
    poked_ = false;
  }
}

void AdvicePublisher::poke() {
  const std::lock_guard lock(mutex_);
  poked_ = true;
  changed_.notify_all();
}

void AdvicePublisher::stop() {
  {
    const std::lock_guard lock(mutex_);
    stop_.request_stop();
    changed_.notify_all();
  }
  if (thread_.joinable()) thread_.join();
}

using calib::DriftAdvice;

int day_number(double utc_s) {
  using namespace std::chrono;
  const year_month_day day{
      floor<days>(sys_time<seconds>(seconds(static_cast<std::int64_t>(utc_s))))};
  return static_cast<int>(day.year()) * 372 +
         static_cast<int>(static_cast<unsigned>(day.month())) * 31 +
         static_cast<int>(static_cast<unsigned>(day.day()));
}

PublishedAdvice advice_of(const calib::DriftChart& chart, double now_s) {
  constexpr double kDayS = 86400.0;
  using enum DriftAdvice;
  static constexpr EnumTable<DriftAdvice, Advice> kTable{{{kNone, Advice::kUnknown},
                                                          {kCheckAgain, Advice::kCheckAgain},
                                                          {kLetItWarmUp, Advice::kLetItWarmUp},
                                                          {kReMeasureTcp, Advice::kReMeasureTcp},
                                                          {kRecalibrate, Advice::kRecalibrate}}};
  const calib::CheckMeasurement* decided = chart.newest_decided();
  // An undecided check does not lower the advice of the one before, which did not hold.
  if (chart.not_held && decided != nullptr)
    return {kTable[calib::remedy_of(
        decided->verdict, decided->change ? decided->change->kind : calib::ChangeKind::kNothing)]};
  if (chart.advice != kNone) return {kTable[chart.advice]};
  if (decided == nullptr || decided->verdict != calib::CheckVerdict::kHolds) return {};
  if (!calib::is_current(decided->time_s, now_s)) return {};
  return {Advice::kHolds, day_number(decided->time_s + calib::kMostDays * kDayS)};
}

}  // namespace cellcal::daemon
