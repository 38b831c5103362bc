// Share of touches in typical plans that corrections in space would refuse, and why: every line of
// every touch is given to the adapter's own check, from a session that begins in KUKA's home pose.
// Prints figures; no threshold.

#include <fmt/format.h>

#include <map>
#include <numbers>

#include "calib/files/files.h"
#include "calib/plan/plan.h"
#include "daemon/config/config.h"
#include "drivers/kuka/rsi/rsi_space.h"
#include "tests/command_line/command_line.h"

namespace {

using namespace cellcal;  // NOLINT: an experiment's own file

constexpr double kRadPerDeg = std::numbers::pi / 180;

drivers::AxisAngles axes(const calib::JointVector& q) { return {q.begin(), q.end()}; }

drivers::AxisAngles minus(const drivers::AxisAngles& a, const drivers::AxisAngles& b) {
  drivers::AxisAngles difference(a);
  for (std::size_t i = 0; i < a.size(); ++i) difference[i] -= b[i];
  return difference;
}

const char* name(const drivers::Cause& objection) {
  namespace cause = drivers::cause;
  if (drivers::is<cause::ShiftLimit>(objection)) return "shift";
  if (drivers::is<cause::TurnLimit>(objection)) return "turn";
  return drivers::is<cause::NearSingular>(objection) ? "singular" : "";
}

struct Options {
  int plans = 10, touches = 50;
  double turn_deg = 180.0, shift_mm = 5000.0;
  bool tool_frame = false, aware = false;
  std::vector<double> start_deg{0, -90, 90, 0, 90, 0};
};

void run(const Options& options) {
  calib::Cell cell = calib::load_cell(CELLCAL_DEMO_CELL);
  daemon::DaemonConfig config;
  config.controller.tool = 1;
  drivers::SpaceCorrection space;
  space.on = true;
  space.limit_mm = options.shift_mm;
  space.turn_limit_deg = options.turn_deg;
  space.frame =
      options.tool_frame ? drivers::CorrectionFrame::kTool : drivers::CorrectionFrame::kBase;
  space.geometry = daemon::controller_arm(config, cell);
  drivers::SpaceCorrector corrector(space);
  drivers::AxisAngles start;
  for (const double deg : options.start_deg) start.push_back(deg * kRadPerDeg);
  corrector.begin(start);

  int touches = 0, lines = 0, searches = 0, refused_touches = 0, refused_searches = 0;
  std::map<std::string, int> refused;
  for (int seed = 1; seed <= options.plans; ++seed) {
    calib::PlanOptions how;
    how.fit_touches = options.touches;
    how.check_touches = 0;
    how.seed = static_cast<unsigned>(seed);
    cell.passable = options.aware ? daemon::passable_in_space(space) : calib::Passable();
    const calib::Plan plan = calib::make_plan(cell, how);
    drivers::AxisAngles at = axes(plan.start);
    for (const calib::PlannedTouch& touch : plan.touches) {
      bool whole = true;
      const auto go = [&](const calib::JointVector& to) {
        ++lines;
        const auto objection = corrector.object_to(minus(at, start), minus(axes(to), start));
        at = axes(to);
        if (objection) ++refused[name(*objection)];
        whole = whole && !objection;
        return !objection;
      };
      for (const calib::JointVector& waypoint : touch.transit) go(waypoint);
      const bool search = go(touch.end);
      go(touch.clear);
      ++touches;
      ++searches;
      refused_touches += whole ? 0 : 1;
      refused_searches += search ? 0 : 1;
    }
  }
  fmt::print(
      "{} plans of {} touches: {} of {} touches have a line that is refused ({:.0f} %), {} "
      "of them the search itself; {} lines in all, refused:",
      options.plans, options.touches, refused_touches, touches, 100.0 * refused_touches / touches,
      refused_searches, lines);
  for (const auto& [why, count] : refused) fmt::print(" {} {}", why, count);
  fmt::print("\n");
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  cellcal::CommandLine app{"Shares of planned touches that corrections in space refuse"};
  app.option("--plans", options.plans);
  app.option("--touches", options.touches);
  app.option("--turn-deg", options.turn_deg, "Limit of the turn");
  app.option("--shift-mm", options.shift_mm, "Limit of the shift");
  app.option("--tool-frame", options.tool_frame, "RefCorrSys Tool instead of Base");
  app.option("--aware", options.aware, "Plans keep clear of singularities, as the daemon has it");
  app.option("--start-deg", options.start_deg, "Where the session begins").count(6);
  if (const auto code = app.parse(argc, argv)) return *code;
  run(options);
  return 0;
}
