#pragma once
// Derives the published status from a session's state.

#include <cstddef>

#include "daemon/service/job.h"
#include "daemon/service/status.h"
#include "daemon/session/state.h"

namespace cellcal::daemon {

/// Leaves `seq`, `links`, `made`, `results_dir` and `time_left_s` to the caller. `done`: number of touches
/// made, including those before a resume.
Status status_of(const State& state, const Job& job, std::size_t done);

}  // namespace cellcal::daemon
