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
// Least travel of the linear unit between the planned touches.
constexpr double kTravelM = 0.1;
constexpr const char* kTable =
    "\n[[positioner]]\nname = \"E1\"\nxyz_mm = [950.0, 0.0, 200.0]\nmin_deg = -120.0\nmax_deg = 120.0\n"
    "place_sigma_mm = 0.5\ndirection_sigma_mrad = 0.5\n";
const Eigen::Vector3d kOnTableM(0.15, 0.0, 0.15);
constexpr double kTurnRad = 0.5;  // least, between the touches

daemon::Tasks tasks_of(const Job& job) {
  daemon::Tasks tasks;
  tasks.plan = [&job] { return daemon::Tasks::Planned{job.plan, job.plan_hash, {}}; };
  tasks.route = [&job](const calib::Plan& plan, const daemon::FindRoute& how,
                       const calib::JointVector& from) {
    // Planned from the emulated arm's position at power on: the path is the plan's own.
    if (how.next == 0 && from == plan.start && !how.in_contact) return plan;
    const auto arm_end = from.begin() + static_cast<std::ptrdiff_t>(job.cell.robot.joints.size());
    return calib::resume_plan(job.cell, plan, how.next, {from.begin(), arm_end}, how.in_contact,
                              {arm_end, from.end()});
  };
  tasks.assess = [](const std::vector<calib::Touch>&) { return daemon::Tasks::Assessed{}; };
  tasks.identify = [](const std::vector<calib::Touch>&) { return daemon::SessionResult{}; };
  tasks.report = [](const daemon::SessionResult&, const std::vector<calib::Touch>&) {};
  return tasks;
}

}  // namespace

namespace {

void put_on_table(calib::Cell& cell) {
  cell.targets.erase(cell.targets.begin() + 1, cell.targets.end());
  cell.lengths.clear();
  cell.targets[0].carried_by = 1;
  cell.targets[0].centre_m = kOnTableM;
}

/// Throws if the external axis does not move between the planned touches.
void require_moves(const calib::Plan& plan, Wire wire) {
  const calib::PlannedTouch &one = plan.touches.at(0), &two = plan.touches.at(1);
  if (on_track(wire) && std::abs(two.standoff[0] - one.standoff[0]) < kTravelM)
    throw std::runtime_error("the linear unit does not travel between the planned touches");
  if (on_table(wire) && std::abs(two.positioner_rad[0] - one.positioner_rad[0]) < kTurnRad)
    throw std::runtime_error("the table does not turn between the planned touches");
}

}  // namespace

Job make_job(const std::filesystem::path& cell_file, Wire wire) {
  Job job;
  job.inputs = daemon::read_inputs(cell_file);
  std::string& robot = job.inputs.robot_text;
  if (on_track(wire)) robot.insert(robot.find("[[joint]]"), kUnit);
  if (on_table(wire)) robot += kTable;
  job.cell = daemon::cell_of(job.inputs);
  if (on_table(wire)) put_on_table(job.cell);
  calib::PlanOptions options;
  options.fit_touches = 2;
  options.check_touches = 0;
  if (on_track(wire)) options.criterion = calib::Criterion::kEven;
  if (on_table(wire)) options.criterion = calib::Criterion::kRandom;
  job.plan = calib::make_plan(job.cell, options);
  job.plan_hash = daemon::plan_hash(job.plan);
  require_moves(job.plan, wire);
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
    ending.marks.push_back({cell.now(), now.phase, now.done});
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
