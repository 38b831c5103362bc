// Cells that publish while collectors and the database are killed: every message in its table, once. Exit status 1: it is not so.

#include <fmt/format.h>

#include <atomic>
#include <chrono>
#include <cstdio>
#include <exception>
#include <memory>
#include <pqxx/pqxx>
#include <random>
#include <stdexcept>
#include <thread>
#include <vector>

#include "tests/bench/plant/collector_process.h"
#include "tests/bench/plant/simulated_cells.h"
#include "tests/command_line/command_line.h"
#include "tests/daemon/fleet/servers.h"

namespace cellcal::bench {
namespace {

using daemon::fleet::testing::Database;
using daemon::fleet::testing::MqttBroker;

constexpr std::int64_t kSession = 1;

struct Options {
  std::string collector = CELLCAL_FLEET;
  std::size_t cells = 100;
  int collectors = 2;
  double rate = 1000.0, seconds = 20.0;
  unsigned seed = 1;
};

struct Faults {
  int collectors = 0, databases = 0;
};

class Plant {
 public:
  explicit Plant(const Options& options) : options_(options), database_(server_.create()) {
    for (int i = 1; i <= options.collectors; ++i) collectors_.push_back(collector(i, true));
  }

  std::uint16_t broker() const { return broker_.port(); }
  const std::string& database() const { return database_; }

  void kill_collector(int index) {
    auto& one = collectors_.at(static_cast<std::size_t>(index));
    one->kill();
    one.reset();
    one = collector(index + 1, false);
  }

  void kill_database(std::chrono::milliseconds away) {
    server_.kill();
    std::this_thread::sleep_for(away);
    server_.start();
  }

 private:
  std::unique_ptr<CollectorProcess> collector(int number, bool wait) {
    return std::make_unique<CollectorProcess>(options_.collector, folder_, broker_.port(),
                                              database_, number, wait);
  }

  Options options_;
  Database server_;
  MqttBroker broker_;
  Folder folder_;
  std::string database_;
  std::vector<std::unique_ptr<CollectorProcess>> collectors_;
};

/// One fault after the other, of each kind as often, until it is enough.
Faults make_faults(Plant& plant, const Options& options, const std::atomic<bool>& enough) {
  std::mt19937 random(options.seed);
  const auto between = [&](int least, int most) {
    return std::uniform_int_distribution<int>(least, most)(random);
  };
  Faults faults;
  while (!enough) {
    std::this_thread::sleep_for(std::chrono::milliseconds(between(50, 1500)));
    if (between(0, 1) == 0) {
      plant.kill_collector(between(0, options.collectors - 1));
      ++faults.collectors;
    } else {
      plant.kill_database(std::chrono::milliseconds(between(0, 1500)));
      ++faults.databases;
    }
  }
  return faults;
}

struct Counted {
  std::size_t rows = 0, different = 0, refused = 0, gaps = 0;
};

Counted counted(const std::string& database) {
  pqxx::connection connection(database);
  pqxx::nontransaction work(connection);
  const auto number = [&](const char* sql) { return work.exec(sql)[0][0].as<std::size_t>(); };
  return {number("SELECT count(*) FROM fleet.touches"),
          number("SELECT count(DISTINCT (journal_id, number)) FROM fleet.touches"),
          number("SELECT count(*) FROM fleet.quarantine"),
          number("SELECT count(*) FROM fleet.gaps")};
}

int run(const Options& options) {
  Plant plant(options);
  SimulatedCells cells(plant.broker(), options.cells);
  std::atomic<bool> enough{false};
  std::exception_ptr failed;
  // Servers end with the thread that started them: the cells have the other one.
  std::jthread publisher([&] {
    try {
      cells.publish_paced(options.rate, options.seconds, kSession);
    } catch (...) {
      failed = std::current_exception();
    }
    enough = true;
  });
  const Faults faults = make_faults(plant, options, enough);
  publisher.join();
  if (failed) std::rethrow_exception(failed);
  const auto sent = static_cast<std::size_t>(options.rate * options.seconds);
  wait_for_touches(plant.database(), kSession, sent);
  const Counted there = counted(plant.database());
  fmt::print(
      "{} messages of {} cells; collectors killed {}, database killed {}\n"
      "in the table {}, different ones {}, refused {}, gaps {}\n",
      sent, options.cells, faults.collectors, faults.databases, there.rows, there.different,
      there.refused, there.gaps);
  const bool once =
      there.rows == sent && there.different == sent && there.refused == 0 && there.gaps == 0;
  fmt::print("{}\n", once ? "each arrived once" : "NOT each arrived once");
  return once ? 0 : 1;
}

}  // namespace
}  // namespace cellcal::bench

int main(int argc, char** argv) {
  cellcal::bench::Options options;
  cellcal::CommandLine line(
      "Collectors and the database are killed while cells publish; what arrives is counted.");
  line.option("--collector", options.collector, "The program cellcal-fleet");
  line.option("--cells", options.cells).between(1, 10000);
  line.option("--collectors", options.collectors).between(1, 8);
  line.option("--rate", options.rate, "Messages a second of all cells").between(1, 1e5);
  line.option("--seconds", options.seconds).between(1, 3600);
  line.option("--seed", options.seed, "Which faults, and when");
  if (const auto status = line.parse(argc, argv)) return *status;
  try {
    return cellcal::bench::run(options);
  } catch (const std::exception& error) {
    fmt::print(stderr, "plant_faults: {}\n", error.what());
    return 1;
  }
}
