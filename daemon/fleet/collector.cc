#include "daemon/fleet/collector.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <optional>
#include <thread>

#include "daemon/files/atomic_file.h"
#include "daemon/fleet/judge.h"

namespace cellcal::daemon::fleet {

namespace {

using Clock = std::chrono::steady_clock;
constexpr std::size_t kMostMessages = 1000;
constexpr std::chrono::milliseconds kIdle{200};
constexpr std::chrono::minutes kMaintenance{1};
constexpr std::chrono::seconds kShortest{1}, kLongest{30};

/// Exponential backoff that logs loss and recovery of a peer.
class Away {
 public:
  Away(const char* what, std::atomic<bool>& up, std::atomic<std::uint64_t>& lost)
      : what_(what), up_(up), lost_(lost) {}

  void is_back() {
    if (up_.exchange(true)) return;
    wait_ = kShortest;
    spdlog::info("{}: connected", what_);
  }
  void has_gone(const std::string& why) {
    if (up_.exchange(false)) ++lost_;
    const std::string words = printable(why);
    spdlog::warn("{} away: {}. Nothing is lost: messages wait in the broker. Trying again in {} s",
                 what_, words.substr(0, words.find_last_not_of(". ") + 1), wait_.count());
  }
  void wait(const std::atomic<bool>& stop, const std::function<void()>& alive) {
    const auto end = Clock::now() + wait_;
    for (int i = 0; !stop && Clock::now() < end; ++i) {
      if (i % 10 == 0) alive();
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
    }
    wait_ = std::min(2 * wait_, kLongest);
  }

 private:
  const char* what_;
  std::atomic<bool>& up_;
  std::atomic<std::uint64_t>& lost_;
  std::chrono::seconds wait_{kShortest};
};

}  // namespace

Collector::Collector(CollectorConfig config)
    : config_(std::move(config)), meters_(config_.allowance) {}

void Collector::run(const std::atomic<bool>& stop, const std::function<void()>& alive) {
  Away no_store("database", counters_.store_up, counters_.store_lost);
  Away no_broker("broker", counters_.broker_up, counters_.broker_lost);
  std::optional<Store> store;
  while (!stop) {
    try {
      if (!store) store.emplace(config_.store);
      no_store.is_back();
      Broker broker(config_.broker);
      no_broker.is_back();
      serve(*store, broker, stop, alive);
    } catch (const StoreUnavailable& away) {
      store.reset();
      no_store.has_gone(away.what());
      no_store.wait(stop, alive);
    } catch (const BrokerUnavailable& away) {
      no_broker.has_gone(away.what());
      no_broker.wait(stop, alive);
    }
  }
}

void Collector::serve(Store& store, Broker& broker, const std::atomic<bool>& stop,
                      const std::function<void()>& alive) {
  std::optional<Clock::time_point> maintained;
  while (!stop) {
    std::vector<Message> messages = broker.receive(kMostMessages, kIdle);
    if (!messages.empty())
      for (const plant::Stored& stored : write(store, std::move(messages))) broker.tell(stored);
    broker.acknowledge();
    alive();
    if (maintained && Clock::now() - *maintained < kMaintenance) continue;
    log_postponed(store.maintain());
    maintained = Clock::now();
  }
}

void Collector::log_postponed(std::vector<std::string> put_off) {
  if (put_off == put_off_) return;
  for (const std::string& words : put_off)
    spdlog::warn(
        "database: put off, others hold the table: {}. Look for long queries in pg_stat_activity",
        words);
  put_off_ = std::move(put_off);
}

std::vector<plant::Stored> Collector::write(Store& store, std::vector<Message> messages) {
  Batch batch;
  const std::size_t count = messages.size();
  // Messages that are not stored are sent again and must not be charged twice.
  const Meters before = meters_;
  for (Message& message : messages) judge(std::move(message), meters_, Clock::now(), batch);
  Written written;
  try {
    written = store.write(batch);
  } catch (const StoreUnavailable&) {
    meters_ = before;
    throw;
  }
  counters_.messages += count;
  counters_.facts += written.facts;
  counters_.twice += written.twice;
  counters_.refused += written.refused;
  ++counters_.batches;
  return std::move(written.stored);
}

namespace {

/// Unlimited, since the message was charged when it was received.
constexpr Allowance kAll{.messages_per_s = 1.0, .burst = 1e18, .bytes_per_day = 1e18};

/// Stores a quarantined message; false if it is refused.
bool take(Store& store, const Kept& kept, Meters& meters, Reread& result) {
  Batch batch;
  judge({kept.topic, kept.payload}, meters, {}, batch);
  if (!batch.refused.empty() || batch.empty()) return false;
  const Written written = store.write(batch);
  if (written.refused > 0) return false;
  result.stored += written.facts + batch.presences.size();
  result.twice += written.twice;
  return true;
}

}  // namespace

Reread reread_quarantine(Store& store) {
  Reread result;
  Meters meters(kAll);
  std::int64_t last = 0;
  for (std::vector<Kept> few = store.kept(last); !few.empty(); few = store.kept(last)) {
    for (const Kept& kept : few) {
      last = kept.id;
      if (!kept.whole)
        result.cut.push_back(fmt::format("{}, {} bytes", kept.topic, kept.bytes));
      else if (take(store, kept, meters, result))
        store.let_go(kept.id);
      else
        ++result.refused;
    }
  }
  return result;
}

}  // namespace cellcal::daemon::fleet
