#pragma once
// Evidence for a cell on this computer: its file, its sessions, the doctor's findings.

#include <filesystem>

#include "daemon/doctor/examiner.h"
#include "daemon/doctor/steps.h"
#include "daemon/journal/journal.h"

namespace cellcal::daemon {

/// Current content of cell and robot file, concatenated; empty where unreadable.
std::string text_of_cell(const std::filesystem::path& cell);

/// For the cell examined last, otherwise that of the newest session.
Evidence evidence_of(const Examination& examination, Journal& journal);

}  // namespace cellcal::daemon
