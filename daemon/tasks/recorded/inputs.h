#pragma once
// The files of a session: read once at its start, kept as text in the journal, and read from that
// text ever after, so that a session means the same when the files have changed.

#include <filesystem>
#include <string>

#include "calib/model/robot.h"
#include "daemon/journal/journal.h"

namespace cellcal::daemon {

/// Reads the cell file and the robot file that it names. Throws calib::FileError.
SessionInputs read_inputs(const std::filesystem::path& cell_file);

/// The cell from stored text. Throws calib::FileError.
calib::Cell cell_of(const SessionInputs& inputs);

}  // namespace cellcal::daemon
