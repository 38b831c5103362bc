#pragma once
// Cells with the real publisher, Debian's broker and database, cellcal-fleet in between; and all kinds of faults, deterministic for a
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
  kBrokerKilled,     ///< SIGKILL
  kBrokerStopped,    ///< orderly
  kDatabaseKilled,   ///< SIGKILL, during a collector's transaction if one occurs
  kCollectorKilled,  ///< SIGKILL
  kCellsCut,         ///< their network, cleanly or silently
  kCollectorsCut,    ///< from broker and database simultaneously
  kClockStepped,     ///< a cell's, by up to twenty years
  kSentAgain,        ///< facts already sent, in any order
  kOvertaken,        ///< facts waiting at a cell, the newest first, before it sends them itself
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
  int rounds = 6;              ///< each has every fault once, in random order
  double pause_s = 1.0;        ///< at most, between two faults
  double outage_s = 3.0;       ///< at most
  double work_every_s = 0.02;  ///< a cell writes a session or another fact
  unsigned seed = 1;
};

struct FaultReport {
  std::array<std::size_t, kFaults> made{};
  std::size_t in_mid_write = 0;               ///< of the killed databases
  std::size_t silent_cuts = 0;                ///< of both kinds; the others were clean
  std::size_t sent_again = 0, overtaken = 0;  ///< number of facts
  double settled_s =
      0.0;  ///< from the last fault until the tables have all results and no cell has any left
  Tally tally;
};

/// Without wires nothing is cut; otherwise `server` listens at Wires::plant(kCollectors). `say` gets each fault. Throws std::runtime_error if data is missing after 150 s.
FaultReport run_faults(const FaultOptions& options, Database& server, const Wires* wires,
                       const std::function<void(const std::string&)>& say = {});

}  // namespace cellcal::daemon::fleet::testing
