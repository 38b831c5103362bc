#pragma once
// Cells with the real publisher, Debian's broker and database, cellcal-fleet between them; and everything that can happen to them, by a
// seed.

#include <array>
#include <cstddef>
#include <functional>
#include <string>

#include "tests/daemon/fleet/faults/tally.h"
#include "tests/daemon/fleet/faults/wires.h"
#include "tests/daemon/fleet/servers.h"

namespace cellcal::daemon::fleet::testing {

enum class Fault {
  kBrokerKilled,     ///< -9
  kBrokerStopped,    ///< in order
  kDatabaseKilled,   ///< -9, while a collector's transaction is open where one can be met
  kCollectorKilled,  ///< -9
  kCellsCut,         ///< their network, cleanly or silently
  kCollectorsCut,    ///< from broker and database at once
  kClockStepped,     ///< a cell's, up to twenty years either way
  kSentAgain,        ///< facts that came already, in any order
  kOvertaken,        ///< facts that wait at a cell, the newest first, before it sends them itself
  kCellRestarted
};
inline constexpr std::size_t kFaults = 10;
const char* to_string(Fault fault);

struct FaultOptions {
  std::string collector;  ///< the program
  std::size_t cells = 6;
  int collectors = 2;
  std::size_t offline_cells = 1;
  double offline_days = 7.0;
  int rounds = 6;              ///< each has every fault once, in an order of its own
  double pause_s = 1.0;        ///< at most, between two
  double outage_s = 3.0;       ///< at most
  double work_every_s = 0.02;  ///< some cell writes a session, or something beside it
  unsigned seed = 1;
};

struct FaultReport {
  std::array<std::size_t, kFaults> made{};
  std::size_t in_mid_write = 0;               ///< of the databases killed
  std::size_t silent_cuts = 0;                ///< of both kinds; the others were clean
  std::size_t sent_again = 0, overtaken = 0;  ///< facts
  double settled_s =
      0.0;  ///< from the last fault until all results were in the tables and no cell kept one
  Tally tally;
};

/// Null wires: nothing is cut; else `server` listens at Wires::plant(kCollectors). `say` is told of each fault. Throws std::runtime_error where not all arrives in two minutes and a half.
FaultReport run_faults(const FaultOptions& options, Database& server, const Wires* wires,
                       const std::function<void(const std::string&)>& say = {});

}  // namespace cellcal::daemon::fleet::testing
