// A thousand cells that publish to one broker, with 1, 2 and 4 collectors: messages per second that reach the tables, their
// latency, and the collectors' resources; for comparison broker and database by themselves.

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <memory>
#include <pqxx/pqxx>
#include <stdexcept>
#include <tuple>
#include <vector>

#include "daemon/fleet/judge.h"
#include "tests/bench/plant/collector_process.h"
#include "tests/bench/plant/simulated_cells.h"
#include "tests/command_line/command_line.h"
#include "tests/daemon/fleet/servers.h"

namespace cellcal::bench {
namespace {

using Clock = std::chrono::steady_clock;
using daemon::fleet::testing::Database;
using daemon::fleet::testing::MqttBroker;

constexpr std::int64_t kFlood = 1, kPaced = 2;

struct Options {
  std::string collector = CELLCAL_FLEET;
  std::size_t cells = 1000, each = 60;
  double rate = 1000.0, seconds = 10.0;
};

double seconds_since(Clock::time_point begun) {
  return std::chrono::duration<double>(Clock::now() - begun).count();
}

/// From the first message's time to the last commit.
double flood_s(pqxx::connection& connection) {
  return pqxx::nontransaction(connection)
      .exec(
          "SELECT extract(epoch FROM max(pg_xact_commit_timestamp(xmin)) - min(at))::float8 "
          "FROM fleet.touches WHERE session = " +
          std::to_string(kFlood))[0][0]
      .as<double>();
}

std::string latencies(pqxx::connection& connection) {
  const pqxx::result row =
      pqxx::nontransaction(connection)
          .exec(
              "SELECT p[1], p[2], p[3] FROM (SELECT percentile_disc(ARRAY[0.5, 0.99, 1]) WITHIN GROUP (ORDER BY "
              "1000 * extract(epoch FROM pg_xact_commit_timestamp(xmin) - at)::float8) AS p "
              "FROM fleet.touches WHERE session = " +
              std::to_string(kPaced) + ") AS all_of_them");
  return fmt::format("{:9.1f} {:9.1f} {:9.1f}", row[0][0].as<double>(), row[0][1].as<double>(),
                     row[0][2].as<double>());
}

void with_collectors(const Options& options, Database& server, int count) {
  const std::string database = server.create();
  MqttBroker broker;
  const Folder folder;
  std::vector<std::unique_ptr<CollectorProcess>> collectors;
  for (int i = 1; i <= count; ++i)
    collectors.push_back(
        std::make_unique<CollectorProcess>(options.collector, folder, broker.port(), database, i));
  pqxx::connection connection(database);
  SimulatedCells cells(broker.port(), options.cells);
  const std::size_t flood = options.cells * options.each;
  cells.publish_all(options.each, kFlood);
  wait_for_touches(database, kFlood, flood);
  const double flooded_s = flood_s(connection);
  double cpu_s = 0.0;
  for (const auto& one : collectors) cpu_s += one->cpu_s();
  const auto begun = Clock::now();
  cells.publish_paced(options.rate, options.seconds, kPaced);
  const double paced_s = seconds_since(begun);
  const auto paced = static_cast<std::size_t>(options.rate * options.seconds);
  wait_for_touches(database, kPaced, paced);
  double megabytes = 0.0;
  for (const auto& one : collectors) megabytes = std::max(megabytes, one->megabytes());
  fmt::print("{:>10} {:10.0f} {:12.0f} {:12.0f} {} {:9.1f}\n", count,
             static_cast<double>(flood) / flooded_s, 1e6 * cpu_s / static_cast<double>(flood),
             static_cast<double>(paced) / paced_s, latencies(connection), megabytes);
  std::fflush(stdout);
}

/// Messages per second of one mosquitto_pub to a broker without subscribers.
double bare_broker(std::size_t count) {
  const MqttBroker broker;
  const Folder folder;
  std::string lines;
  for (std::size_t i = 1; i <= count; ++i)
    lines += touch_message(1, static_cast<std::int64_t>(i), kFlood) + '\n';
  const auto file = folder.write("lines", lines);
  const auto begun = Clock::now();
  const daemon::testing::Outcome outcome = daemon::testing::run_program(
      {"/bin/sh", "-c",
       fmt::format("exec mosquitto_pub -V 5 -h 127.0.0.1 -p {} -q 1 -l -t {} < {}", broker.port(),
                   touch_topic(1), file.string())});
  if (outcome.status != 0) throw std::runtime_error("mosquitto_pub: " + outcome.err);
  return static_cast<double>(count) / seconds_since(begun);
}

/// Messages per second by COPY into a table of one column, one transaction.
double bare_copy(Database& server, std::size_t count) {
  pqxx::connection connection(server.create());
  pqxx::nontransaction(connection)
      .exec("CREATE TABLE bare(number bigint PRIMARY KEY, message jsonb)");
  const auto begun = Clock::now();
  pqxx::work work(connection);
  pqxx::stream_to rows(work, "bare");
  for (std::size_t i = 1; i <= count; ++i)
    rows << std::make_tuple(i, touch_message(1, static_cast<std::int64_t>(i), kFlood));
  rows.complete();
  work.commit();
  return static_cast<double>(count) / seconds_since(begun);
}

/// A plant in operation for some time: for each cell 400 facts of sessions, 200 checks, 50 calibrations of 7 kB, 50 alarms, 300 of
/// health.
constexpr const char* kPlant = R"sql(
SET search_path = fleet;
INSERT INTO cells (plant, cell) SELECT 'graz', 'cell-' || i FROM generate_series(1, {0}) i;
INSERT INTO journals (cell_id, name, numbers) SELECT id, 'j', int8multirange(int8range(1, 1001)) FROM cells;
INSERT INTO presence SELECT id, id % 10 <> 0, false, 'j', 900, '1.9.0', false, now(), now() FROM cells;
INSERT INTO session_facts (journal_id, number, session, at, state, purpose, cell_file, robot_file, started, touches, planned,
  failure_kind, failure, software) SELECT j.id, n * 2, n / 2, now(), CASE WHEN n % 2 = 0 THEN 'running' ELSE 'done' END,
  'check', 'c', 'r', 't', 8, 8, '', '', '1.9.0' FROM journals j, generate_series(1, 400) n;
INSERT INTO checks (journal_id, number, session, at, against, held, shift_mm, u_mm, cause, document, sha256)
  SELECT j.id, n * 4 + 1, n, now(), 1, 'yes', 0.1, 0.05, '', convert_to(repeat('x', 1500), 'UTF8'), 's'
  FROM journals j, generate_series(1, 200) n;
INSERT INTO calibrations (journal_id, number, session, at, robot, robot_serial, published, is_update, findings, near_mm, over_mm,
  document, sha256) SELECT j.id, n * 16 + 3, n * 8, now(), 'KR 5', '1', true, false, '{{}}', 0.1, 0.2,
  convert_to(repeat('x', 7000), 'UTF8'), 's' FROM journals j, generate_series(1, 50) n;
INSERT INTO alarms (journal_id, number, session, at, news, subject, text) SELECT j.id, n * 8 + 5, n, now(),
  CASE WHEN n % 7 = 0 THEN 'drifted' ELSE 'done' END, 's', 't' FROM journals j, generate_series(1, 50) n;
INSERT INTO health (journal_id, number, session, at, packets, gaps, late, replies, reply_p99_ms, reply_max_ms, frames, crc_errors,
  sensor_late_ms, waiting, journal_bytes) SELECT j.id, n, 0, now(), 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1
  FROM journals j, generate_series(1, 300) n;
ANALYZE;
)sql";

/// Queries of a plant's page and of `cellcal fleet status`, each the best of ten.
void answers(const Options& options, Database& server) {
  const std::string database = server.create();
  daemon::fleet::Store({database}).maintain();
  daemon::fleet::testing::ask(database, fmt::format(kPlant, options.cells));
  daemon::fleet::Reading reading(database);
  const auto best_ms = [](const auto& asked) {
    constexpr int kTimes = 10;
    double best = 1e9;
    for (int i = 0; i < kTimes; ++i) {
      const auto begun = Clock::now();
      asked();
      best = std::min(best, 1e3 * seconds_since(begun));
    }
    return best;
  };
  fmt::print(
      "\n{} rows of {} cells: all cells with what they need {:.1f} ms, one cell {:.1f} ms, overdue {:.1f} ms, figures "
      "for Prometheus {:.1f} ms\n",
      1000 * options.cells, options.cells, best_ms([&] { reading.cells(); }), best_ms([&] {
        reading.cell({"graz", "cell-1"});
      }),
      best_ms([&] { reading.overdue(); }), best_ms([&] { reading.totals(); }));
}

int run(const Options& options) {
  constexpr std::size_t kBare = 20'000;
  Database server(daemon::fleet::testing::Disk::kWaitedFor);
  fmt::print("a touch has {} bytes; commits wait for the disk\n",
             touch_message(1, 1, kFlood).size());
  fmt::print("mosquitto_pub, one process, no subscriber: {:.0f} messages/s\n", bare_broker(kBare));
  fmt::print("COPY of the messages, one transaction: {:.0f} messages/s\n\n",
             bare_copy(server, kBare));
  fmt::print("{} cells; {} messages each at once, then {:.0f}/s of all for {:.0f} s\n\n",
             options.cells, options.each, options.rate, options.seconds);
  fmt::print("{:>10} {:>10} {:>12} {:>12} {:>9} {:>9} {:>9} {:>9}\n", "collectors", "at once/s",
             "CPU us/each", "paced/s", "p50 ms", "p99 ms", "worst ms", "most MB");
  for (const int count : {1, 2, 4}) with_collectors(options, server, count);
  answers(options, server);
  return 0;
}

}  // namespace
}  // namespace cellcal::bench

int main(int argc, char** argv) {
  cellcal::bench::Options options;
  cellcal::CommandLine line(
      "Many cells, one broker, one database: what reaches the tables, and how soon.");
  line.option("--collector", options.collector, "The program cellcal-fleet");
  line.option("--cells", options.cells).between(1, 10000);
  line.option("--each", options.each, "Messages of each cell at once").between(1, 10000);
  line.option("--rate", options.rate, "Messages a second of all cells, for the latency")
      .between(1, 1e6);
  line.option("--seconds", options.seconds).between(1, 600);
  if (const auto status = line.parse(argc, argv)) return *status;
  try {
    return cellcal::bench::run(options);
  } catch (const std::exception& error) {
    fmt::print(stderr, "plant_bench: {}\n", error.what());
    return 1;
  }
}
