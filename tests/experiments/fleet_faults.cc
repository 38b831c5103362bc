// Cells of a plant with all kinds of faults, by a seed; their journals compared with the tables. Exit status 1: not every result once
// and in order.

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <chrono>
#include <cstdio>
#include <exception>

#include "tests/command_line/command_line.h"
#include "tests/daemon/fleet/faults/faulty_plant.h"

namespace {

using namespace cellcal::daemon::fleet::testing;

void print(const FaultReport& report) {
  const Tally& tally = report.tally;
  fmt::print("\n{:>8} {}\n", "times", "what happened");
  for (std::size_t i = 0; i < kFaults; ++i)
    fmt::print("{:>8} {}\n", report.made[i], to_string(static_cast<Fault>(i)));
  fmt::print(
      "databases killed with a transaction open: {}; cuts that nobody was told of: {}\n"
      "facts sent again: {}; facts that overtook others: {}\n\n",
      report.in_mid_write, report.silent_cuts, report.sent_again, report.overtaken);
  fmt::print("{:>10} {:>10} {:>10}\n", "", "results", "telemetry");
  fmt::print("{:>10} {:>10} {:>10}\n", "written", tally.results, tally.telemetry);
  fmt::print("{:>10} {:>10} {:>10}\n", "stored", tally.stored_results, tally.stored_telemetry);
  fmt::print("{:>10} {:>10} {:>10}\n", "missing", tally.missing_results, tally.missing_telemetry);
  fmt::print(
      "rows twice {}, out of order {}, of no cell {}, documents altered {}, refused {}, states wrong {}\n"
      "{} {:.1f} s after the last fault\n",
      tally.twice, tally.out_of_order, tally.strangers, tally.altered, tally.refused,
      tally.states_wrong, tally.missing_results == 0 ? "all there" : "given up", report.settled_s);
  fmt::print("{}\n", tally.is_right() ? "every result once, in order"
                                      : "NOT every result once and in order");
}

}  // namespace

int main(int argc, char** argv) {
  FaultOptions options;
  options.collector = CELLCAL_FLEET;
  bool no_cuts = false, verbose = false;
  cellcal::CommandLine line(
      "Cells, broker, database and collectors to which everything happens; what arrives is counted.");
  line.option("--cells", options.cells).between(1, 100);
  line.option("--collectors", options.collectors).between(1, 8);
  line.option("--offline", options.offline_cells,
              "Cells that come back from so many days without a line")
      .between(0, 20);
  line.option("--days", options.offline_days, "Days that they were away").between(0, 60);
  line.option("--rounds", options.rounds, "Each has every fault once").between(1, 10000);
  line.option("--pause", options.pause_s, "Seconds between two faults, at most").between(0, 600);
  line.option("--outage", options.outage_s, "Seconds that something is away, at most")
      .between(0, 600);
  line.option("--seed", options.seed, "Which faults, and when");
  line.option("--no-cuts", no_cuts, "All on the loopback: no network is cut");
  line.option("--verbose", verbose, "Names each fault");
  if (const auto status = line.parse(argc, argv)) return *status;
  spdlog::set_level(spdlog::level::off);  // of the publishers, whose connections keep failing
  try {
    std::string why_not = "--no-cuts";
    const std::unique_ptr<Wires> wires = no_cuts ? nullptr : Wires::lay(why_not);
    if (!wires) fmt::print("no network is cut: {}\n", why_not);
    fmt::print("{} cells, {} of them back from {} days offline; {} collectors; seed {}\n",
               options.cells + options.offline_cells, options.offline_cells, options.offline_days,
               options.collectors, options.seed);
    std::fflush(stdout);
    const auto begun = std::chrono::steady_clock::now();
    Database server(Disk::kNotWaitedFor, wires ? Wires::plant(Wires::Side::kCollectors) : "");
    const FaultReport report =
        run_faults(options, server, wires.get(), [&](const std::string& words) {
          if (!verbose) return;
          fmt::print(
              "{:7.2f} s {}\n",
              std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count(),
              words);
          std::fflush(stdout);
        });
    print(report);
    return report.tally.is_right() ? 0 : 1;
  } catch (const std::exception& error) {
    fmt::print(stderr, "fleet_faults: {}\n", error.what());
    return 1;
  }
}
