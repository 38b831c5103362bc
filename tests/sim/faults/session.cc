#include "session.h"

#include <cmath>

#include "daemon/service/journal_recorder.h"
#include "daemon/tasks/options.h"
#include "daemon/tasks/tasks.h"

namespace cellcal::faults {
namespace {

constexpr const char* kUnit =
    "[[joint]]\nname = \"E1\"\nkind = \"prismatic\"\nalong = [0.0, 1.0, 0.0]\nmin_mm = -400.0\n"
    "max_mm = 400.0\nmax_speed_mm_s = 1500.0\n\n";
// Least way of the linear unit between the planned touches.
constexpr double kTravelM = 0.1;

daemon::Tasks tasks_of(const Job& job) {
  daemon::Tasks tasks;
  tasks.plan = [&job] { return daemon::Tasks::Planned{job.plan, job.plan_hash, {}}; };
  tasks.route = [&job](const calib::Plan& plan, std::size_t next, const calib::JointVector& from) {
    // Planned from the emulated arm's position at power on: the path is the plan's own.
    if (next == 0 && from == plan.start) return plan;
    return calib::resume_plan(job.cell, plan, next, from);
  };
  tasks.assess = [](const std::vector<calib::Touch>&) { return daemon::Tasks::Assessed{}; };
  tasks.identify = [](const std::vector<calib::Touch>&) { return daemon::SessionResult{}; };
  tasks.report = [](const daemon::SessionResult&, const std::vector<calib::Touch>&) {};
  return tasks;
}

}  // namespace

Job make_job(const std::filesystem::path& cell_file, bool on_track) {
  Job job;
  job.inputs = daemon::read_inputs(cell_file);
  std::string& robot = job.inputs.robot_text;
  if (on_track) robot.insert(robot.find("[[joint]]"), kUnit);
  job.cell = daemon::cell_of(job.inputs);
  calib::PlanOptions options;
  options.fit_touches = 2;
  options.check_touches = 0;
  if (on_track) options.criterion = calib::Criterion::kEven;
  job.plan = calib::make_plan(job.cell, options);
  job.plan_hash = daemon::plan_hash(job.plan);
  if (on_track && std::abs(job.plan.touches.at(1).standoff[0] - job.plan.touches.at(0).standoff[0]) < kTravelM)
    throw std::runtime_error("the linear unit does not travel between the planned touches");
  return job;
}

Ending run_session(FaultyCell& cell, const Job& job, daemon::Journal& journal, std::int64_t session,
                   bool resumed, const std::function<void(daemon::Runner&)>& on_begin, int retries,
                   daemon::BusyRepeats repeats, bool unattended) {
  CellBackend backend(cell);
  daemon::JournalRecorder recorder(journal, session, backend);
  daemon::InlineWorker worker;
  daemon::State state;
  state.timeouts.connecting = std::chrono::seconds(15);  // no operator comes to this pendant
  state.retries = retries;
  state.repeats = repeats;
  state.unattended = unattended;
  state.policy.confirm_every = 1;  // all elements of a touch
  // If the network stops the arm a session searches at 1 mm/s; twice that meets the same
  // requirements.
  if (cell.wire() == Wire::kEkiFlag) state.policy.slow_m_s = 0.002;
  std::vector<calib::Touch> touches;
  if (resumed) {
    touches = journal.touches(session);
    state.resumed = true;
    state.done = touches.size();
    state.expected_hash = journal.session(session)->plan_hash;
  }
  Ending ending;
  const auto note = [&](const daemon::State& now, const std::vector<calib::Touch>&) {
    const bool planned = now.plan && now.current_index() < now.plan->touches.size();
    const bool last = planned && now.waypoint + 1 >= now.planned().transit.size();
    ending.marks.push_back({cell.now(), now.phase, now.done, last});
    ending.state = now;
  };
  daemon::Runner runner({backend, recorder, worker, worker, tasks_of(job), note}, state, touches);
  if (on_begin) on_begin(runner);
  try {
    ending.state = runner.run();
  } catch (const std::runtime_error& error) {
    ending.hung = error.what();
  }
  ending.t = cell.now();
  return ending;
}

}  // namespace cellcal::faults
