#pragma once
// Facts in the cells' journals compared with the plant's tables.

#include <cstddef>
#include <string>
#include <vector>

#include "tests/daemon/fleet/faults/reporting_cell.h"

namespace cellcal::daemon::fleet::testing {

struct Tally {
  std::size_t results = 0, telemetry = 0;                  ///< in the journals
  std::size_t stored_results = 0, stored_telemetry = 0;    ///< rows, each number once
  std::size_t twice = 0;                                   ///< rows beyond the first of a number
  std::size_t missing_results = 0, missing_telemetry = 0;  ///< numbers without a row
  /// Rows whose number has another kind, session or time in the journal: not in the journal's order.
  std::size_t out_of_order = 0;
  std::size_t strangers = 0;  ///< rows absent from all journals
  std::size_t altered =
      0;  ///< documents that differ from their SHA-256, or from those sent by the cell
  std::size_t refused = 0;
  /// Cells whose newest session in fleet.cell_states is not the newest of their journal.
  std::size_t states_wrong = 0;

  /// Every result once, in order. Telemetry may be lost with a killed broker, never duplicated.
  bool is_right() const {
    return missing_results + twice + out_of_order + strangers + altered + refused + states_wrong ==
           0;
  }
};

/// Throws exceptions of libpqxx.
Tally tally(const std::string& database, const std::vector<Truth>& cells);

/// Results of all cells with a row. Throws like tally().
std::size_t stored_results(const std::string& database);

}  // namespace cellcal::daemon::fleet::testing
