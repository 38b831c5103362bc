#include "tests/daemon/fleet/faults/faulty_plant.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <map>
#include <numeric>
#include <pqxx/pqxx>
#include <stdexcept>
#include <thread>

#include "daemon/plant/messages/fact.h"
#include "tests/bench/plant/collector_process.h"
#include "tests/daemon/plant/line/listener.h"

namespace cellcal::daemon::fleet::testing {

namespace {

using Clock = std::chrono::steady_clock;
using Side = Wires::Side;

constexpr std::chrono::seconds kGiveUp{150};
/// The broker's port in the networks of cells and collectors, where no other exists.
constexpr std::uint16_t kPort = 1883;
constexpr double kYear_s = 365.25 * 86'400.0;

std::string listeners(const Wires* wires) {
  if (wires == nullptr) return "";
  return fmt::format("listener {0} {1}\nlistener {0} {2}\n", kPort, Wires::plant(Side::kCells),
                     Wires::plant(Side::kCollectors));
}

class Plant {
 public:
  Plant(const FaultOptions& options, Database& server, const Wires* wires,
        const std::function<void(const std::string&)>& say)
      : options_(options),
        wires_(wires),
        say_(say),
        random_(options.seed),
        server_(server),
        broker_(listeners(wires)),
        database_(server_.create()) {
    for (int i = 1; i <= options.collectors; ++i) collectors_.push_back(collector(i, true));
    repeater_ = std::make_unique<daemon::testing::Listener>(broker_.port(), "repeater",
                                                            "cellcal/+/+/fact/+");
    for (std::size_t i = 0; i < options.cells + options.offline_cells; ++i)
      cells_.push_back(std::make_unique<ReportingCell>(folder_.path / fmt::format("cell-{}", i),
                                                       fmt::format("cell-{}", i),
                                                       options.seed + static_cast<unsigned>(i)));
    for (std::size_t i = 0; i < options.cells; ++i) connect(*cells_[i]);
    for (std::size_t i = options.cells; i < cells_.size(); ++i)
      cells_[i]->work_offline(options.offline_days);
  }

  void work(const std::atomic<bool>& enough) {
    std::minstd_rand which(options_.seed);
    while (!enough) {
      cells_[std::uniform_int_distribution<std::size_t>(0, options_.cells - 1)(which)]->work();
      std::this_thread::sleep_for(std::chrono::duration<double>(options_.work_every_s));
    }
  }

  void make_faults() {
    std::array<Fault, kFaults> order{};
    for (std::size_t i = 0; i < kFaults; ++i) order[i] = static_cast<Fault>(i);
    for (int round = 0; round < options_.rounds; ++round) {
      std::shuffle(order.begin(), order.end(), random_);
      for (const Fault fault : order) {
        pause(options_.pause_s);
        mend_what_is_due();
        make(fault);
      }
      // During the faults the offline cells reconnect.
      if (round == 0)
        for (std::size_t i = options_.cells; i < cells_.size(); ++i) connect(*cells_[i]);
    }
    for (const auto& [side, when] : cuts_) wires_->mend(side);
    cuts_.clear();
  }

  FaultReport settle() {
    const auto begun = Clock::now();
    std::vector<Truth> truths;
    std::size_t results = 0;
    for (const auto& cell : cells_) {
      truths.push_back(cell->truth());
      results += static_cast<std::size_t>(
          std::count_if(truths.back().facts.begin(), truths.back().facts.end(),
                        [](const ReportedFact& fact) { return fact.is_result(); }));
    }
    while (!nothing_waits() || stored_results(database_) < results) {
      if (Clock::now() - begun > kGiveUp) {
        say("not all arrived");
        for (const auto& cell : cells_) say(cell->words());
        break;
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
    }
    report_.settled_s = std::chrono::duration<double>(Clock::now() - begun).count();
    report_.tally = tally(database_, truths);
    return report_;
  }

 private:
  void say(const std::string& words) const {
    if (say_) say_(words);
  }

  int between(int least, int most) {
    return std::uniform_int_distribution<int>(least, most)(random_);
  }
  double up_to(double most) { return std::uniform_real_distribution<double>(0.0, most)(random_); }
  void pause(double most_s) {
    std::this_thread::sleep_for(std::chrono::duration<double>(up_to(most_s)));
  }

  void within(Side side, const std::function<void()>& start) const {
    if (wires_ == nullptr) return start();
    wires_->within(side, start);
  }

  void connect(ReportingCell& cell) const {
    within(Side::kCells, [&] {
      if (wires_ == nullptr)
        cell.connect("127.0.0.1", broker_.port());
      else
        cell.connect(Wires::plant(Side::kCells), kPort);
    });
  }

  std::unique_ptr<bench::CollectorProcess> collector(int number, bool wait) const {
    std::unique_ptr<bench::CollectorProcess> made;
    within(Side::kCollectors, [&] {
      if (wires_ == nullptr)
        made = std::make_unique<bench::CollectorProcess>(options_.collector, folder_,
                                                         broker_.port(), database_, number, wait);
      else
        made = std::make_unique<bench::CollectorProcess>(options_.collector, folder_, kPort,
                                                         server_.uri(), number, wait,
                                                         Wires::plant(Side::kCollectors));
    });
    return made;
  }

  bool nothing_waits() const {
    return std::all_of(cells_.begin(), cells_.end(),
                       [](const auto& cell) { return cell->waiting_rows() == 0; });
  }

  void make(Fault fault) {
    const bool is_cut = fault == Fault::kCellsCut || fault == Fault::kCollectorsCut;
    if (is_cut && wires_ == nullptr) return;
    ++report_.made[static_cast<std::size_t>(fault)];
    say(to_string(fault));
    switch (fault) {
      case Fault::kBrokerKilled:
        broker_.kill();
        pause(options_.outage_s);
        return broker_.start();
      case Fault::kBrokerStopped:
        broker_.stop();
        pause(options_.outage_s);
        return broker_.start();
      case Fault::kDatabaseKilled:
        if (waited_for_a_transaction()) ++report_.in_mid_write;
        server_.kill();
        pause(options_.outage_s);
        return server_.start();
      case Fault::kCollectorKilled: return kill_collector(between(0, options_.collectors - 1));
      case Fault::kCellsCut: return cut(Side::kCells);
      case Fault::kCollectorsCut: return cut(Side::kCollectors);
      case Fault::kClockStepped:
        return any_cell().set_clock(up_to(40.0 * kYear_s) - 20.0 * kYear_s);
      case Fault::kSentAgain: return send_again();
      case Fault::kOvertaken: return overtake();
      case Fault::kCellRestarted: {
        ReportingCell& cell = any_cell();
        cell.restart();
        return connect(cell);
      }
    }
  }

  ReportingCell& any_cell() {
    return *cells_[static_cast<std::size_t>(between(0, static_cast<int>(options_.cells) - 1))];
  }

  /// True if a transaction is open within two seconds.
  bool waited_for_a_transaction() const try {
    pqxx::connection connection(database_);
    pqxx::nontransaction asking(connection);
    const auto end = Clock::now() + std::chrono::seconds(2);
    while (Clock::now() < end) {
      if (asking
              .exec("SELECT count(*) FROM pg_stat_activity WHERE datname = current_database() AND "
                    "pid <> pg_backend_pid() AND backend_xid IS NOT NULL")[0][0]
              .as<int>() > 0)
        return true;
    }
    return false;
  } catch (const pqxx::failure&) {
    return false;
  }

  void kill_collector(int index) {
    auto& one = collectors_.at(static_cast<std::size_t>(index));
    one->kill();
    one.reset();
    pause(options_.outage_s);
    one = collector(index + 1, false);
  }

  void cut(Side side) {
    const bool silent = between(0, 1) == 1;
    report_.silent_cuts += silent ? 1 : 0;
    wires_->mend(side);
    wires_->cut(side, silent ? Wires::Cut::kSilent : Wires::Cut::kClean);
    cuts_[side] = Clock::now() + std::chrono::duration_cast<Clock::duration>(
                                     std::chrono::duration<double>(up_to(2.0 * options_.outage_s)));
  }

  void mend_what_is_due() {
    std::erase_if(cuts_, [&](const auto& one) {
      const bool due = Clock::now() > one.second;
      if (due) wires_->mend(one.first);
      return due;
    });
  }

  void send_again() {
    const std::vector<daemon::testing::Heard> heard = repeater_->all();
    std::vector<Publication> all;
    for (int i = 0; i < 100 && !heard.empty(); ++i) {
      const auto& one =
          heard[static_cast<std::size_t>(between(0, static_cast<int>(heard.size()) - 1))];
      all.push_back({one.topic, one.payload});
    }
    publish(broker_.port(), all);
    report_.sent_again += all.size();
  }

  void overtake() {
    for (const auto& cell : cells_) {
      std::vector<plant::Fact> facts = cell->waiting(50);
      std::vector<Publication> all;
      for (auto one = facts.rbegin(); one != facts.rend(); ++one)
        all.push_back({plant::to_text({one->of, plant::Subject::kFact, plant::kind_of(one->body)}),
                       plant::to_json(*one)});
      if (all.empty()) continue;
      publish(broker_.port(), all);
      report_.overtaken += all.size();
    }
  }

  const FaultOptions& options_;
  const Wires* wires_;
  const std::function<void(const std::string&)>& say_;
  std::mt19937 random_;
  Database& server_;
  MqttBroker broker_;
  bench::Folder folder_;
  std::string database_;
  std::vector<std::unique_ptr<bench::CollectorProcess>> collectors_;
  std::unique_ptr<daemon::testing::Listener> repeater_;
  std::vector<std::unique_ptr<ReportingCell>> cells_;
  std::map<Side, Clock::time_point> cuts_;
  FaultReport report_;
};

}  // namespace

const char* to_string(Fault fault) {
  switch (fault) {
    case Fault::kBrokerKilled: return "broker killed";
    case Fault::kBrokerStopped: return "broker stopped";
    case Fault::kDatabaseKilled: return "database killed";
    case Fault::kCollectorKilled: return "collector killed";
    case Fault::kCellsCut: return "cells cut off";
    case Fault::kCollectorsCut: return "collectors cut off";
    case Fault::kClockStepped: return "clock stepped";
    case Fault::kSentAgain: return "facts sent again";
    case Fault::kOvertaken: return "facts overtaken";
    case Fault::kCellRestarted: return "cell restarted";
  }
  return "";
}

FaultReport run_faults(const FaultOptions& options, Database& server, const Wires* wires,
                       const std::function<void(const std::string&)>& say) {
  Plant plant(options, server, wires, say);
  std::atomic<bool> enough{false};
  // Servers end with the thread that started them, which therefore makes the faults.
  std::exception_ptr failed;
  std::thread cells([&] {
    try {
      plant.work(enough);
    } catch (...) {
      failed = std::current_exception();
    }
  });
  try {
    plant.make_faults();
  } catch (...) {
    enough = true;
    cells.join();
    throw;
  }
  enough = true;
  cells.join();
  if (failed) std::rethrow_exception(failed);
  return plant.settle();
}

}  // namespace cellcal::daemon::fleet::testing
