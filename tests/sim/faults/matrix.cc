#include "matrix.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "daemon/session/driver_phrase.h"
#include "drivers/kuka/rsi/rsi_stops.h"

namespace cellcal::faults {
namespace {

using daemon::FailureKind;
using daemon::Phase;
using std::chrono::milliseconds;

double seconds(Duration d) { return std::chrono::duration<double>(d).count(); }

/// Above the duration of any session of two touches, including the timeouts of every phase.
constexpr std::chrono::minutes kLongestRun{10};
/// Above the duration of every temporary fault.
constexpr milliseconds kAfterwards{3000};

std::uint64_t mixed(std::uint64_t x) {  // splitmix64
  x += 0x9E3779B97F4A7C15u;
  x = (x ^ (x >> 30)) * 0xBF58476D1CE4E5B9u;
  x = (x ^ (x >> 27)) * 0x94D049BB133111EBu;
  return x ^ (x >> 31);
}
double unit(std::uint64_t x) { return static_cast<double>(mixed(x) >> 11) * 0x1p-53; }

/// Names without a cause.
bool names_a_cause(FailureKind kind) {
  switch (kind) {
    case FailureKind::kTimeout:
    case FailureKind::kUnexpectedEvent:
    case FailureKind::kPlan:
    case FailureKind::kPlanChanged:
    case FailureKind::kJournal:
    case FailureKind::kIdentify:
    case FailureKind::kReport: return false;
    default: return true;
  }
}

/// Intervals of the second touch, from the session's own record.
std::vector<Stretch> stretches_of(const Ending& ending, const FaultyCell& cell) {
  const auto since = [&](TimePoint t) { return t - cell.power_on(); };
  struct Span {
    Phase phase;
    std::size_t done;
    Duration from, until;
  };
  std::vector<Span> spans;
  for (const Mark& mark : ending.marks) {
    if (!spans.empty() && spans.back().phase == mark.phase && spans.back().done == mark.done) {
      continue;
    }
    if (!spans.empty()) spans.back().until = since(mark.t);
    spans.push_back({mark.phase, mark.done, since(mark.t), since(mark.t)});
  }
  const auto nth = [&](Phase phase, std::size_t done, int n) {
    for (const Span& span : spans) {
      if (span.phase == phase && span.done == done && n-- == 0) return span;
    }
    throw std::runtime_error(fmt::format("the session without faults has no phase '{}' at touch {}",
                                         to_string(phase), done + 1));
  };
  const auto edge_in = [&](const Span& span) {
    for (const Edge& edge : cell.edges()) {
      const Duration t = since(edge.t);
      if (edge.closed && t > span.from && t < span.until) return t;
    }
    throw std::runtime_error("the session without faults has a search without contact");
  };
  const auto part = [](const Span& span, double from, double until) {
    const auto at = [&](double share) {
      return span.from + std::chrono::duration_cast<Duration>((span.until - span.from) * share);
    };
    return std::pair{at(from), at(until)};
  };
  // The retreat from the first touch leads to the second, or to where the arm waits for the table.
  const Phase way = on_table(cell.wire()) ? Phase::kTransit : Phase::kRetreat;
  const Span transit = nth(way, 1, 0), arming = nth(Phase::kArmingFast, 1, 0);
  const Span fast = nth(Phase::kFastSearch, 1, 0), slow = nth(Phase::kSlowSearch, 1, 0);
  const Span last = nth(Phase::kSlowSearch, 1, 1);
  const Span back = nth(Phase::kBackingOff, 1, 0), leave = nth(Phase::kRetreat, 2, 0);
  const auto [travel_from, travel_until] = part(transit, 0.1, 0.6);
  const auto [near_from, near_until] = part(transit, 0.8, 1.0);
  const auto [back_from, back_until] = part(back, 0.0, 0.9);
  const auto [leave_from, leave_until] = part(leave, 0.0, 0.9);
  const Duration fast_edge = edge_in(fast), slow_edge = edge_in(slow), last_edge = edge_in(last);
  constexpr milliseconds kBefore{20}, kBehind{2};
  return {{TouchPhase::kConnect, "from the start", milliseconds(0), milliseconds(5)},
          {TouchPhase::kConnect, "while identifying", milliseconds(10), milliseconds(100)},
          {TouchPhase::kTransit, "", travel_from, travel_until},
          {TouchPhase::kApproach, "", near_from, std::max(near_until, arming.until)},
          {TouchPhase::kSearch, "fast", fast.from + kBehind, fast_edge - kBefore},
          {TouchPhase::kSearch, "slow", slow.from + kBehind, slow_edge - kBefore},
          {TouchPhase::kContact, "fast", fast_edge, fast_edge},
          {TouchPhase::kContact, "slow", last_edge, last_edge},
          {TouchPhase::kLatch, "fast", fast_edge + kBehind, fast.until},
          {TouchPhase::kLatch, "slow", last_edge + kBehind, last.until},
          {TouchPhase::kRetreat, "back-off", back_from, back_until},
          {TouchPhase::kRetreat, "to the clear point", leave_from, leave_until}};
}

/// The session's phase at t must match the column.
bool fits(TouchPhase phase, Phase was) {
  switch (phase) {
    case TouchPhase::kConnect:
      return was == Phase::kConnecting || was == Phase::kReferencing || was == Phase::kRouting ||
             was == Phase::kIdle || was == Phase::kPlanning;
    case TouchPhase::kTransit: return was == Phase::kRetreat || was == Phase::kTransit;
    case TouchPhase::kApproach:
      return was == Phase::kRetreat || was == Phase::kTransit || was == Phase::kArmingFast;
    case TouchPhase::kSearch:
    case TouchPhase::kContact:
    case TouchPhase::kLatch: return was == Phase::kFastSearch || was == Phase::kSlowSearch;
    case TouchPhase::kRetreat: return was == Phase::kBackingOff || was == Phase::kRetreat;
  }
  return false;
}

/// Removes the journal of the preceding run, with its auxiliary files.
void forget(const std::filesystem::path& journal) {
  for (const char* ending : {"", ".head", ".lock", "-wal", "-shm"})
    std::filesystem::remove(journal.string() + ending);
}

}  // namespace

struct Matrix::Run {
  Wire wire;
  const Fault& fault;
  const Stretch& stretch;
  FaultyCell& cell;
  std::filesystem::path file;
  TimePoint at;  ///< of the fault
  std::int64_t session = 0;
  Ending ending{};
  std::vector<calib::Touch> touches{};  ///< on disk at the end of the session
  Verdict verdict{};

  void broke(std::string what) { verdict.violations.push_back(std::move(what)); }
};

Matrix::Matrix(const std::filesystem::path& cell_file, std::filesystem::path folder,
               std::uint64_t seed, Expectation expectation)
    : cell_file_(cell_file), folder_(std::move(folder)), seed_(seed), expectation_(expectation) {}

const Job& Matrix::job(Wire wire) {
  if (const auto known = jobs_.find(wire); known != jobs_.end()) return known->second;
  return jobs_.emplace(wire, make_job(cell_file_, wire)).first->second;
}

const Reference& Matrix::reference(Wire wire) {
  if (const auto known = references_.find(wire); known != references_.end()) return known->second;
  CellOptions options;
  options.wire = wire;
  options.seed = seed_;
  const auto cell = make_cell(job(wire).cell, options);
  const auto file = folder_ / "reference.db";
  forget(file);
  daemon::Journal journal(file);
  const CellBackend backend(*cell);
  const std::int64_t session = journal.begin(job(wire).inputs, "2000-01-01T00:00:00.000Z");
  cell->end_by(cell->now() + kLongestRun);
  const Ending ending = run_session(*cell, job(wire), journal, session, false);
  if (ending.state.phase != Phase::kDone) {
    throw std::runtime_error(
        "the session without faults fails: " + ending.hung +
        (ending.state.failure ? describe(*ending.state.failure) : std::string()));
  }
  Reference reference{stretches_of(ending, *cell), journal.touches(session),
                      ending.t - cell->power_on()};
  return references_.emplace(wire, std::move(reference)).first->second;
}

double Matrix::distance_from_truth_m(const FaultyCell& cell, const calib::Touch& touch) const {
  double nearest = std::numeric_limits<double>::infinity();
  const Eigen::Vector3d tip =
      cell.physical().tip_m(touch.joint_rad) + Eigen::Vector3d(0, 0, expectation_.truth_off_m);
  for (const Edge& edge : cell.edges()) {
    if (edge.closed) {
      nearest = std::min(nearest, (cell.physical().tip_m(edge.joint_rad) - tip).norm());
    }
  }
  // An edge alone might belong to another contact: the surface must be there, too.
  std::vector<double> at = touch.joint_rad;
  at.insert(at.end(), touch.positioner_rad.begin(), touch.positioner_rad.end());
  return std::max(nearest, std::abs(cell.physical().gap_m(at)));
}

void Matrix::judge_touches(Run& run, const std::vector<calib::Touch>& touches, const char* when) {
  for (std::size_t i = 0; i < touches.size(); ++i) {
    const double off_m = distance_from_truth_m(run.cell, touches[i]);
    run.verdict.worst_m = std::max(run.verdict.worst_m, off_m);
    if (!(off_m <= expectation_.touch_m)) {
      run.broke(fmt::format("touch {} {} is {:.4f} mm from where the tip truly met the sphere",
                            i + 1, when, off_m * 1e3));
    }
  }
}

void Matrix::judge_ending(Run& run) {
  const daemon::State& state = run.ending.state;
  if (!run.ending.hung.empty()) {
    std::string last;
    for (const Mark& mark : run.ending.marks) {
      const std::string step =
          fmt::format("{:.2f} s {}", seconds(mark.t - run.cell.power_on()), to_string(mark.phase));
      if (step != last) last += "; " + step;
    }
    run.broke("a time-out of the run itself: " + run.ending.hung + " (" +
              last.substr(last.size() > 600 ? last.size() - 600 : 0) + ")");
  }
  if (run.touches.size() > job(run.wire).plan.touches.size())
    run.broke("more touches than were planned");
  const std::size_t whole = run.stretch.phase == TouchPhase::kConnect ? 0 : 1;
  const auto& first = reference(run.wire).touches.front();
  // For any effect of a fault on the clocks, measurements before it must be unchanged.
  const bool same_before = !run.fault.before;
  if (run.touches.size() < whole ||
      (whole > 0 && same_before && run.touches.front().joint_rad != first.joint_rad)) {
    run.broke("the touch that was on disk before the fault is not there as it was");
  }
  if (state.phase == Phase::kDone) {
    if (run.touches.size() != job(run.wire).plan.touches.size())
      run.broke("done without all touches");
    return;
  }
  run.verdict.outcome = Outcome::kNamed;
  if (state.phase == Phase::kAborted) {
    run.verdict.name = "aborted";
    run.verdict.words = "stopped on request";
    if (!run.fault.asks_for_end) run.broke("ended as if on request, and nobody asked for it");
  } else if (state.failure) {
    run.verdict.name = to_string(state.failure->kind);
    run.verdict.words = words(state.failure->detail);
    if (state.failure->kind == FailureKind::kNoContact) {
      run.broke("'no contact': " + words(state.failure->detail));
    } else if (!names_a_cause(state.failure->kind) || state.failure->detail.empty()) {
      run.broke("no cause is named: " + describe(*state.failure));
    }
  } else if (run.ending.hung.empty()) {
    run.broke("ended without a word");
  }
}

void Matrix::judge_depth(Run& run) {
  run.verdict.deepest_m = run.cell.deepest_m();
  if (run.verdict.deepest_m > expectation_.deepest_m)
    run.broke(fmt::format("the tip was {:.2f} mm inside a sphere (limit {:.2f} mm)",
                          run.verdict.deepest_m * 1e3, expectation_.deepest_m * 1e3));
  if (run.cell.crashes() > 0) run.broke("the tool's shaft met a sphere");
}

double Matrix::longest_to_rest_s(const Run& run) const {
  const bool searching = run.stretch.phase == TouchPhase::kSearch;
  const double ramp_s = searching ? expectation_.search_ramp_s : expectation_.ramp_s;
  // Time until the controller stops autonomously: EKI's dead man, the loops of its two programs and
  // of the network. RSI holds the last correction.
  constexpr double kEkiDeadManS = 0.25, kEkiLoopsS = 0.05;
  const double wire_s = over_rsi(run.wire) ? 0.0 : kEkiLoopsS;
  if (!run.fault.silences) return ramp_s + (over_rsi(run.wire) ? 0.0 : kEkiDeadManS + wire_s);
  switch (*run.fault.silences) {
    case Silent::kRobot: return ramp_s + (over_rsi(run.wire) ? 0.0 : kEkiDeadManS + wire_s);
    case Silent::kSensor:
      if (run.wire == Wire::kRsiInput) return ramp_s + seconds(drivers::kInputWatchLimit);
      return ramp_s + wire_s +
             seconds(searching ? Duration{drivers::kHeartbeatLimit}
                               : Duration{drivers::kIdleLimit});
    case Silent::kHand: return ramp_s + wire_s;
  }
  return 0.0;
}

void Matrix::judge_rest(Run& run) {
  FaultyCell& cell = run.cell;
  cell.live(kAfterwards);
  const TimePoint since = run.fault.silences ? run.at : std::max(run.at, run.ending.t);
  const double rest_s = std::max(0.0, seconds(cell.last_motion() - since));
  const double limit_s = longest_to_rest_s(run);
  run.verdict.rest_s = rest_s;
  if (rest_s > limit_s) {
    run.broke(fmt::format("the arm moves {:.2f} s after the {} (limit {:.2f} s)", rest_s,
                          run.fault.silences ? "fault" : "error", limit_s));
  }
}

void Matrix::judge_reconnection(Run& run) {
  FaultyCell& cell = run.cell;
  cell.repair();
  cell.new_adapters();
  cell.robot().open();
  cell.contact().open();
  const TimePoint deadline = cell.now() + std::chrono::seconds(15);
  while (cell.robot().state().link != drivers::RobotLink::kNotReferenced && cell.now() < deadline) {
    cell.live(milliseconds(1));
  }
  if (cell.robot().state().link != drivers::RobotLink::kNotReferenced) {
    return run.broke("mended, and the link does not come back: " +
                     words(daemon::phrase_of(cell.robot().state().words)));
  }
  drivers::Move move;
  move.id = 1;
  move.target_rad = cell.robot().state().actual_rad;
  move.target_rad[0] += 0.02;
  cell.robot().begin(move);
  const TimePoint asked = cell.now();
  cell.live(milliseconds(500));
  const auto result = cell.robot().poll();
  if (!result || result->outcome == drivers::MoveOutcome::kArrived) {
    run.broke("a move without a reference after the reconnection is not refused");
  }
  if (cell.last_motion() > asked) run.broke("the arm moves after the reconnection, not referenced");
  cell.robot().close();
  cell.contact().close();
  cell.live(milliseconds(100));
}

void Matrix::judge_resumption(Run& run) {
  daemon::Journal journal(run.file);
  const auto found = journal.newest_resumable();
  if (!found || found->id != run.session) return run.broke("the session cannot be resumed");
  if (journal.touches(run.session) != run.touches) run.broke("the journal read again is another");
  journal.resume(run.session, "2000-01-02T00:00:00.000Z");
  run.cell.repair();
  run.cell.new_adapters();
  run.cell.end_by(run.cell.now() + kLongestRun);
  const Ending ending = run_session(run.cell, job(run.wire), journal, run.session, true);
  if (ending.state.phase != Phase::kDone) {
    return run.broke("mended and resumed, it ends with: " + ending.hung +
                     (ending.state.failure ? describe(*ending.state.failure) : std::string()));
  }
  std::vector<calib::Touch> touches = journal.touches(run.session);
  if (touches.size() != job(run.wire).plan.touches.size())
    run.broke("resumed, and not all touches");
  judge_touches(run, touches, "of the resumed session");
  touches.resize(std::min(touches.size(), run.touches.size()));
  if (touches != run.touches) run.broke("the resumed session has changed touches on disk");
}

Verdict Matrix::run(Wire wire, const Fault& fault, const Stretch& stretch, std::uint64_t number) {
  const Reference& reference = this->reference(wire);
  CellOptions options;
  options.wire = wire;
  options.seed = seed_;
  const double u = unit(seed_ * 1'000'003 + number);
  const Duration offset =
      stretch.from + std::chrono::duration_cast<Duration>((stretch.until - stretch.from) * u);
  if (fault.before) fault.before(options, options.power_on + offset);
  const auto cell = make_cell(job(wire).cell, options);
  Run run{wire, fault, stretch, *cell, folder_ / "run.db", cell->power_on() + offset};
  cell->end_by(cell->power_on() + reference.lasts + kLongestRun);
  forget(run.file);
  {
    daemon::Journal journal(run.file);
    run.session = journal.begin(job(wire).inputs, "2000-01-01T00:00:00.000Z");
    run.ending = run_session(
        *cell, job(wire), journal, run.session, false,
        [&](daemon::Runner& runner) {
          if (fault.book) fault.book({*cell, run.at, &runner});
        },
        expectation_.retries, expectation_.repeats);
    run.verdict.interruptions = run.ending.state.interruptions.total();
    run.touches = journal.touches(run.session);
  }
  if (expectation_.check_phase) {
    Phase was = Phase::kIdle;
    for (const Mark& mark : run.ending.marks) {
      if (mark.t <= run.at) was = mark.phase;
    }
    if (!fits(stretch.phase, was)) {
      run.broke(fmt::format("the fault was to come in {}, and came while '{}'",
                            to_string(stretch.phase), to_string(was)));
    }
  }
  judge_touches(run, run.touches, "on disk");
  judge_ending(run);
  judge_depth(run);
  const std::string beyond = cell->command_beyond();
  if (fault.replies_arrive && !beyond.empty())
    run.broke("commanded beyond the axes' limits: " + beyond);
  if (run.ending.state.phase != Phase::kDone && run.ending.hung.empty()) {
    judge_rest(run);
    judge_reconnection(run);
    judge_resumption(run);
  }
  if (!run.verdict.violations.empty()) run.verdict.outcome = Outcome::kViolation;
  return run.verdict;
}

}  // namespace cellcal::faults
