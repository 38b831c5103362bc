#pragma once
// A session of two touches with the daemon's own rules, runner and journal, on the faulty cell.
// Without identification and report: the judgement ends with the touches on disk.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "calib/plan/plan.h"
#include "cell.h"
#include "daemon/journal/journal.h"
#include "daemon/runner/runner.h"

namespace cellcal::faults {

/// A cell and two touches on it.
struct Job {
  calib::Cell cell;
  daemon::SessionInputs inputs;
  calib::Plan plan;
  std::string plan_hash;
};
/// ..Track: the arm of the cell file is put on a linear unit, which travels between the touches. ..Table: its
/// first sphere alone, on a table that turns between them.
Job make_job(const std::filesystem::path& cell_file, Wire wire = Wire::kRsi);

/// Phases of the session with their times, from its own record.
struct Mark {
  TimePoint t{};
  daemon::Phase phase = daemon::Phase::kIdle;
  std::size_t done = 0;  ///< touches on disk
};

struct Ending {
  daemon::State state;
  std::string hung;  ///< not empty: the session did not end
  TimePoint t{};
  std::vector<Mark> marks;
};

/// Runs a session in the journal to its end: a new one, or one resumed from `state`. `on_begin`
/// gets the runner before the start; `retries` and `repeats` as under [session].
Ending run_session(FaultyCell& cell, const Job& job, daemon::Journal& journal, std::int64_t session,
                   bool resumed, const std::function<void(daemon::Runner&)>& on_begin = {},
                   int retries = 0, daemon::BusyRepeats repeats = {}, bool unattended = false);

}  // namespace cellcal::faults
