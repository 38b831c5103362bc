#pragma once
// What there is of a cell on this computer: its file, its sessions, what the doctor found.

#include <filesystem>

#include "daemon/doctor/examiner.h"
#include "daemon/doctor/steps.h"
#include "daemon/journal/journal.h"

namespace cellcal::daemon {

/// Cell and robot file as they are read now, in one piece; empty where they cannot be read.
std::string text_of_cell(const std::filesystem::path& cell);

/// Of the cell that was examined last, else of the newest session's.
Evidence evidence_of(const Examination& examination, Journal& journal);

}  // namespace cellcal::daemon
