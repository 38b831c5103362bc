#pragma once
// The two kinds of faulty cell. Internal to make_cell().

#include "cell.h"

namespace cellcal::faults {

std::unique_ptr<FaultyCell> make_rsi_cell(const calib::Cell& cell, const CellOptions& options,
                                          const daemon::DaemonConfig& config);
std::unique_ptr<FaultyCell> make_eki_cell(const calib::Cell& cell, const CellOptions& options,
                                          const daemon::DaemonConfig& config);

}  // namespace cellcal::faults
