#pragma once
// What others see of a session: from where its sequence stands.

#include <cstddef>

#include "daemon/service/job.h"
#include "daemon/service/status.h"
#include "daemon/session/state.h"

namespace cellcal::daemon {

/// Without what comes from elsewhere: `seq`, `links`, `made`, `results_dir`, `time_left_s`. `done`: touches made, those
/// before it was resumed among them.
Status status_of(const State& state, const Job& job, std::size_t done);

}  // namespace cellcal::daemon
