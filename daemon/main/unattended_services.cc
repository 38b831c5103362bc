#include "daemon/main/unattended_services.h"

#include <spdlog/spdlog.h>
#include <sys/timex.h>
#include <unistd.h>

#include <chrono>
#include <fstream>
#include <string>

#include "daemon/plant/desk/journal_outbox.h"
#include "daemon/runner/backend.h"
#include "daemon/unattended/notice.h"

namespace cellcal::daemon {

namespace {

UtcSeconds wall_clock() {
  return std::chrono::duration_cast<std::chrono::seconds>(
             std::chrono::system_clock::now().time_since_epoch())
      .count();
}

/// Id of this boot; empty where the kernel does not provide it.
std::string boot_id() {
  std::string id;
  std::ifstream("/proc/sys/kernel/random/boot_id") >> id;
  return id;
}

/// Criterion of systemd's timedated (NTPSynchronized): a time source has bounded the kernel's error below 16
/// s.
bool clock_synchronised() {
  constexpr long kUnbounded_us = 16'000'000;
  timex kernel{};
  return ::adjtimex(&kernel) >= 0 && kernel.maxerror < kUnbounded_us;
}

RetentionRule rule_of(const DaemonConfig& config) {
  return {config.retain_days, config.retain_megabytes};
}

/// Runs between sessions, which do not wait for it.
void drop_old(SessionService& service, Journal& journal, const DaemonConfig& config,
              Schedule& schedule) {
  RetentionRule rule = rule_of(config);
  const auto idle = [&service] { return !kActivePhases.has(service.status().phase); };
  try {
    const UtcSeconds now = wall_clock();  // before it is judged
    if (rule.days && !schedule.trusts_clock()) {
      spdlog::warn(
          "[retention] days = {}: not applied, this computer's clock is in doubt. Check date and "
          "time, then: 'cellcal schedule --release'; or connect a time source (NTP)",
          *rule.days);
      rule.days.reset();
    }
    if (!rule.any()) return;
    const auto gone = journal.retain(limits_of(rule, now), wall_clock_utc(), false, idle);
    if (!gone.empty())
      spdlog::info("[retention]: raw events and readings of {} sessions dropped", gone.size());
  } catch (const std::exception& failed) {
    spdlog::error("[retention]: {}", failed.what());
  }
}

/// Between two passes of the schedule.
constexpr std::chrono::seconds kPeriod{5};

void pass(Schedule& schedule) try { schedule.update(); } catch (const std::exception& failed) {
  spdlog::error("schedule: {}", failed.what());
}

Report alarm_of(const Notice& notice, const std::string& host) {
  const Message words = compose(notice, calib::Language(), host);
  return plant::report_of(plant::AlarmFact{to_string(notice.news), words.subject, words.body});
}

/// Alarms not already reported to the plant with a session's end (alarms_with_end()).
std::function<void(const Notice&)> alarm_to_plant(Journal& journal, const std::string& host) {
  return [&journal, host](const Notice& notice) {
    const bool with_its_end = notice.session != 0 && !notice.by_chart;
    if (notice.news == News::kDone || with_its_end) return;
    journal.report(notice.session, alarm_of(notice, host));
  };
}

std::string host_name() {
  char name[256] = "";
  if (::gethostname(name, sizeof name - 1) != 0) return "cellcald";
  return name;
}

}  // namespace

std::function<std::vector<Report>(std::int64_t, const RecordEnd&)> alarms_with_end(
    Journal& journal, LiveConfig& live) {
  return [&journal, &live](std::int64_t session, const RecordEnd& end) -> std::vector<Report> {
    if (!live.now()->plant) return {};
    const Notice notice = notice_of_end(session, end, wall_clock_utc(), journal);
    if (notice.news == News::kDone) return {};
    return {alarm_of(notice, host_name())};
  };
}

UnattendedServices::UnattendedServices(SessionService& service, Journal& journal, LiveConfig& live)
    : journal_(journal),
      live_(live),
      notifier_({.config = [this] { return live_.now()->notify; },
                 .host = host_name(),
                 .also =
                     [this] {
                       return live_.now()->plant ? alarm_to_plant(journal_, host_name()) : nullptr;
                     }}),
      gateway_(service, journal),
      schedule_({gateway_,
                 {[this] { return journal_.schedule(); },
                  [this](const std::string& state) { journal_.store_schedule(state); }},
                 [this] { return live_.now()->schedule; },
                 {wall_clock, std::chrono::steady_clock::now, boot_id(), clock_synchronised},
                 [this](const Decision& decision) {
                   notifier_.notify([decision, this] { return news_of(decision, journal_); });
                 }}),
      updates_([this] { pass(schedule_); }, kPeriod),
      housekeeping_([this, &service] { drop_old(service, journal_, *live_.now(), schedule_); }) {
  housekeeping_.ask();
}

/// Each end once: the status of an end is repeated.
void UnattendedServices::update(const Status& status) {
  if (!is_final(status.phase)) {
    reported_ = false;
    return;
  }
  if (!reported_.exchange(true))
    notifier_.notify([status, this] { return news_of(status, journal_); });
  poke();
}

RetentionRule UnattendedServices::retention() const { return rule_of(*live_.now()); }

void UnattendedServices::poke() {
  updates_.ask();
  housekeeping_.ask();
}

}  // namespace cellcal::daemon
