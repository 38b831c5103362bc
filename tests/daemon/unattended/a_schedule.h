#pragma once
// A schedule in virtual time: a fake cell, clocks set by the test.

#include <gtest/gtest.h>

#include <memory>

#include "daemon/unattended/schedule.h"
#include "tests/daemon/unattended/zone.h"

namespace cellcal::daemon {
namespace {

using testing::kBerlin;
using testing::kHour;
using testing::Zone;
using namespace std::chrono_literals;
using EndState = Standing::State;

constexpr UtcSeconds kDay = 24 * kHour;

struct FakeCell final : SessionGateway {
  Standing standing() override { return now; }
  std::int64_t begin(const ScheduledSession& session, const std::string& by,
                     std::uint64_t aborts) override {
    if (aborts != now.aborts) throw NotNow("aborted");
    if (!wrong.empty()) throw std::runtime_error(wrong);
    begun.push_back(session.name);
    said = by;
    ++now.session;
    now.busy = true;
    return now.session;
  }
  std::int64_t resume(const std::string& by, std::uint64_t) override {
    said = by;
    ++resumed;
    now.busy = true;
    return now.session;
  }
  void stop() override {
    ++stopped;
    end(EndState::kAborted, {FailureKind::kWindowOver, "the window is over"});
  }
  void show(const ScheduleSeen& schedule) override { shown = schedule; }
  double foreseen_s(const ScheduledSession&) override { return takes_s; }

  void end(EndState state, Failure failure = {}) {
    now.busy = false;
    now.state = state;
    now.failure = std::move(failure);
    now.end = std::to_string(++ends);
  }
  void person_runs(EndState state) {
    ++now.session;
    end(state);
  }

  Standing now;
  ScheduleSeen shown;
  std::vector<std::string> begun;
  std::string said, wrong;
  int resumed = 0, stopped = 0, ends = 0;
  double takes_s = 1800.0;
};

/// Starts at noon.
struct ASchedule : ::testing::Test {
  ASchedule() {
    config.unattended = true;
    config.program_start = ProgramStart::kCell;
    config.responsible = "A. Miller";
    ScheduledSession nightly;
    nightly.name = "nightly";
    nightly.cell = "/c.toml";
    nightly.window.from_min = 22 * 60;
    nightly.window.to_min = 5 * 60;
    config.sessions.push_back(nightly);
    begin_at(2026y / 11 / 22);
  }
  void begin_at(std::chrono::year_month_day day) {
    WeeklyWindow noon;
    noon.from_min = 12 * 60;
    noon.to_min = 13 * 60;
    utc = window_on(noon, std::chrono::sys_days(day)).begins;
    restart();
  }
  void restart() {
    schedule = std::make_unique<Schedule>(Schedule::Parts{
        cell,
        {[this] {
           return StoredSchedule{stored, newest};
         },
         [this](const std::string& state) {
           if (disk_full) throw std::runtime_error("no space left on the disk");
           stored = state;
         }},
        [this] { return config; },
        {[this] { return utc; }, [this] { return steady; }, boot, [this] { return synchronised; }},
        [this](const Decision& d) { reported.push_back(d); }});
  }
  void pass(UtcSeconds seconds) {
    utc += seconds;
    steady += std::chrono::seconds(seconds);
    schedule->update();
  }
  /// In steps, like a thread.
  void live(UtcSeconds seconds, UtcSeconds step = 600) {
    for (UtcSeconds at = 0; at < seconds; at += step) pass(step);
  }
  int count(Verb verb, Why why) const {
    int found = 0;
    for (const Decision& d : reported) found += d.verb == verb && d.why == why ? 1 : 0;
    return found;
  }

  const Zone zone{kBerlin};
  std::string stored, boot = "first";
  bool disk_full = false, synchronised = true, newest = true;
  FakeCell cell;
  ScheduleConfig config;
  UtcSeconds utc = 0;
  Schedule::Steady steady{std::chrono::hours(1)};
  std::vector<Decision> reported;
  std::unique_ptr<Schedule> schedule;
};

}  // namespace
}  // namespace cellcal::daemon
