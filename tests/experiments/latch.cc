// How far the latched joint angles are from where the tip really was when it met the sphere: the
// adapters and the sensor's driver as the daemon uses them, the emulated controller with its lag,
// the emulated sensor with its clock and line, an arm without errors. Prints, and gates nothing.
//
// The error is the gap between tip and surface at the latched angles: positive where they lie
// before the contact. Angles come with four decimals, as a controller with Precision 4 sends them.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <memory>
#include <numbers>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "calib/files/files.h"
#include "calib/model/random.h"
#include "calib/plan/plan.h"
#include "daemon/backends/virtual_cell.h"
#include "daemon/config/space_config.h"
#include "drivers/contact/serial_contact.h"
#include "drivers/io_thread.h"
#include "drivers/kuka/rsi/rsi_robot.h"
#include "sim/cell/contact_watch.h"
#include "sim/krc/krc_udp.h"
#include "sim/mcu/mcu_pty.h"
#include "tests/command_line/command_line.h"

namespace {

using namespace cellcal;           // NOLINT: an experiment's own file
using namespace cellcal::drivers;  // NOLINT
using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr double kRadPerDeg = std::numbers::pi / 180;
constexpr milliseconds kLook{1};
constexpr seconds kPatience{20}, kArmLifetime{20};
constexpr double kRunUpM = 0.002, kRunUpSpreadM = 0.0005, kBeyondM = 0.003;
constexpr double kTransitMS = 0.02;
/// Angles are sent in steps of 1e-4 deg.
constexpr double kDecimalsRad = 1e-4 * kRadPerDeg;

struct Setting {
  double speed_m_s = 0.002;
  double lag_s = 0.02;
  int baud = CTP_DEFAULT_BAUD;
  bool space = false;
};

struct Errors {
  std::vector<double> um, reaction_ms;
  std::map<std::string, int> failed;

  double mean() const {
    double sum = 0.0;
    for (const double e : um) sum += e;
    return um.empty() ? 0.0 : sum / static_cast<double>(um.size());
  }
  double sigma() const {
    double sum = 0.0;
    for (const double e : um) sum += (e - mean()) * (e - mean());
    return um.size() < 2 ? 0.0 : std::sqrt(sum / static_cast<double>(um.size() - 1));
  }
  double worst() const {
    double most = 0.0;
    for (const double e : um)
      if (std::abs(e) > std::abs(most)) most = e;
    return most;
  }
  double slowest_reaction_ms() const {
    return reaction_ms.empty() ? 0.0 : *std::max_element(reaction_ms.begin(), reaction_ms.end());
  }
};

/// A search line: joint angles by the tip's travel from the stand-off.
struct Line {
  calib::PlannedTouch touch;

  AxisAngles at(double travel_m) const {
    AxisAngles q;
    const double share = travel_m / touch.search_m;
    for (std::size_t i = 0; i < touch.standoff.size(); ++i)
      q.push_back(touch.standoff[i] + share * (touch.end[i] - touch.standoff[i]));
    return q;
  }
};

/// Both sides of the wires.
struct Rig {
  Robot& robot;
  ContactSensor& contact;
  Clock& clock;
  const sim::PhysicalCell& truth;
};

bool eventually(Clock& clock, const std::function<bool()>& done) {
  const TimePoint end = clock.now() + kPatience;
  while (!done()) {
    if (clock.now() > end) return false;
    clock.sleep_until(clock.now() + kLook);
  }
  return true;
}

/// Empty, or what keeps the two from being ready.
std::string make_ready(Rig& rig) {
  if (!eventually(rig.clock, [&] { return rig.contact.status().link == ContactLink::kReady; }))
    return rig.contact.status().words;
  const bool ready = eventually(rig.clock, [&] {
    if (rig.robot.state().link == RobotLink::kNotReferenced) {
      rig.robot.rereference();
      rig.clock.sleep_until(rig.clock.now() + milliseconds{20});
    }
    return rig.robot.state().link == RobotLink::kReady;
  });
  return ready ? "" : rig.robot.state().words;
}

std::optional<MoveResult> move(Rig& rig, const Move& what) {
  rig.robot.begin(what);
  std::optional<MoveResult> result;
  eventually(rig.clock, [&] { return (result = rig.robot.poll()).has_value(); });
  return result;
}

/// Searches along one line, each from elsewhere before the surface, so that contact falls anywhere
/// in the cycle.
Errors measure(Rig& rig, const Line& line, double speed_m_s, int searches, unsigned seed) {
  calib::Random random(seed);
  Errors errors;
  std::uint32_t move_id = 0;
  std::uint16_t arm_id = 0;
  bool in_contact = false;
  double at_m = 0.0;
  for (int k = 0; k < searches; ++k) {
    if (const std::string trouble = make_ready(rig); !trouble.empty()) {
      ++errors.failed[trouble];
      return errors;
    }
    // Constant speed by the time of the contact.
    const double run_up = kRunUpM + speed_m_s * speed_m_s / 0.02;
    const double from = line.touch.expected_m - run_up - kRunUpSpreadM * random.uniform();
    const Move back{++move_id, in_contact ? MoveKind::kRetreat : MoveKind::kTransit, line.at(from),
                    std::max(1e-3, std::abs(at_m - from)) / kTransitMS, 0};
    const auto there = move(rig, back);
    at_m = from;
    if (!there || there->outcome != MoveOutcome::kArrived) {
      ++errors.failed[there ? there->detail : "no end of the way back"];
      continue;
    }
    in_contact = false;
    if (!eventually(rig.clock, [&] { return !rig.contact.status().in_contact; })) {
      ++errors.failed["still in contact"];
      continue;
    }
    rig.contact.arm(++arm_id, kArmLifetime);
    std::optional<ArmResult> armed;
    eventually(rig.clock, [&] { return (armed = rig.contact.poll_arm()).has_value(); });
    if (!armed || !armed->armed) {
      ++errors.failed[armed ? armed->why_not : "no answer to arm()"];
      continue;
    }
    const double to = line.touch.expected_m + kBeyondM;
    const auto result =
        move(rig, {++move_id, MoveKind::kSearch, line.at(to), (to - from) / speed_m_s, arm_id});
    in_contact = true;
    at_m = line.touch.expected_m;
    if (!result || result->outcome != MoveOutcome::kContact || !result->latch) {
      ++errors.failed[result ? std::string(to_string(result->outcome)) + ": " + result->detail
                             : "no end of the search"];
      continue;
    }
    const auto& latched = result->latch->contact_rad;
    errors.um.push_back(1e6 *
                        rig.truth.gap_m(std::span<const double>(latched.data(), latched.size())));
    errors.reaction_ms.push_back(1e3 * result->latch->reaction_s);
  }
  return errors;
}

sim::TruthOptions no_errors() {
  sim::TruthOptions truth;
  truth.geometry_scale = 0.0;
  truth.deflection = 0.0;
  truth.placement_m = truth.placement_rad = 0.0;
  return truth;
}

daemon::DaemonConfig with_tool() {
  daemon::DaemonConfig config;
  config.controller.tool = 1;
  return config;
}

RsiConfig rsi_config(const calib::Cell& cell, bool space) {
  RsiConfig config;
  config.bind_address = "127.0.0.1";
  config.port = 0;
  for (const calib::Joint& joint : cell.robot.joints)
    config.limits.push_back({joint.min_rad, joint.max_rad, 1.0, 10.0, 140.0});
  config.correction_limit_deg.assign(cell.robot.joints.size(), 90.0);
  // A shared machine may stall for tens of milliseconds.
  config.silence_cycles = 50;
  config.late_replies_limit = 50;
  config.space.on = space;
  config.space.limit_mm = 1000.0;
  if (space) config.space.geometry = daemon::controller_arm(with_tool(), cell);
  return config;
}

sim::ControllerConfig controller_config(const calib::Cell& cell, const Line& line,
                                        const Setting& setting) {
  sim::ControllerConfig config;
  config.start_rad = line.touch.standoff;
  config.lag_s = setting.lag_s;
  if (setting.space) config.arm = sim::make_cartesian_arm(cell);
  return config;
}

/// Idle machine, direct cables, exact clocks: what the method itself costs.
Errors on_virtual_wires(const calib::Cell& cell, const Line& line, const Setting& setting,
                        int searches, unsigned seed) {
  daemon::VirtualCellOptions options;
  options.truth = no_errors();
  options.controller = controller_config(cell, line, setting);
  options.mcu.baud = setting.baud;
  options.mcu.drift_ppm = 30.0;
  options.contact.baud = setting.baud;
  options.rsi = rsi_config(cell, setting.space);
  daemon::VirtualCell virtual_cell(cell, options);
  const sim::PhysicalCell truth(virtual_cell.truth());
  virtual_cell.contact().open();
  virtual_cell.robot().open();
  Rig rig{virtual_cell.robot(), virtual_cell.contact(), virtual_cell, truth};
  return measure(rig, line, setting.speed_m_s, searches, seed);
}

/// UDP on the loopback and a pseudo-terminal, in real time.
Errors on_real_wires(const calib::Cell& cell, const Line& line, const Setting& setting,
                     int searches, unsigned seed) {
  const sim::PhysicalCell truth(sim::draw_truth(cell, no_errors()));
  sim::McuPtyOptions mcu;
  mcu.mcu.baud = setting.baud;
  mcu.mcu.drift_ppm = 30.0;
  sim::McuPty sensor(mcu);
  IoThread io;
  SerialContactOptions serial;
  serial.port = {sensor.path(), setting.baud};
  SerialContact contact(io.context(), serial);
  RsiRobot robot(io.context(), rsi_config(cell, setting.space), &contact.guard());
  io.start();
  contact.open();
  robot.open();
  sim::ContactWatch watch(truth, [&](TimePoint t, bool closed) { sensor.edge(t, closed); });
  sim::KrcUdpOptions udp;
  udp.pc_port = robot.port();
  udp.realtime = true;
  sim::KrcUdp krc(
      controller_config(cell, line, setting), udp, [&](sim::Controller& c, TimePoint now) {
        watch.look(now, now + c.cycle(), [&](TimePoint t) { return c.actual_rad_at(t); });
      });
  krc.start();
  Rig rig{robot, contact, steady_clock(), truth};
  Errors errors = measure(rig, line, setting.speed_m_s, searches, seed);
  robot.close();
  eventually(steady_clock(), [&] { return robot.port() == 0; });
  krc.stop();
  contact.close();
  io.stop();
  return errors;
}

/// What rounding the angles as the controller sends them changes in the gap, 1 sigma: no latch can
/// be better.
double rounding_um(const sim::PhysicalCell& truth, const Line& line) {
  double sum = 0.0;
  constexpr int kDraws = 1000;
  calib::Random random(1);
  const AxisAngles at = line.at(line.touch.expected_m);
  const std::vector<double> exact(at.begin(), at.end());
  const double gap = truth.gap_m(exact);
  for (int k = 0; k < kDraws; ++k) {
    std::vector<double> q = exact;
    for (double& angle : q) angle += kDecimalsRad * (random.uniform() - 0.5);
    sum += std::pow(1e6 * (truth.gap_m(q) - gap), 2);
  }
  return std::sqrt(sum / kDraws);
}

struct Options {
  std::vector<double> speeds_mm_s{1, 2, 5, 10};
  std::vector<double> lags_ms{10, 20, 40};
  std::vector<int> bauds{115'200, 1'000'000};
  int searches = 100, real_searches = 15;
  unsigned seed = 1;
  bool space = false;
};

void run(const Options& options) {
  calib::Cell cell = calib::load_cell(CELLCAL_DEMO_CELL);
  for (calib::Target& target : cell.targets) target.diameter_sigma_m = 0.0;  // the true one
  calib::PlanOptions how;
  how.fit_touches = 24;
  how.check_touches = 0;
  how.seed = options.seed;
  const calib::Plan plan = calib::make_plan(cell, how);
  const sim::PhysicalCell truth(sim::draw_truth(cell, no_errors()));

  fmt::print(
      "Gap between tip and surface at the latched angles, um; positive: before the contact.\n"
      "virtual: {} searches a row, no time but the wires' and the cycle's. wires: {} searches a "
      "row,\nUDP and pseudo-terminal in real time. rounding: of the angles to four decimals "
      "alone, 1 sigma.\n\n{:>6} {:>6} {:>8} {:>9} | {:>7} {:>7} {:>7} {:>9} | {:>7} {:>7} {:>7} "
      "{:>9} {:>7}\n",
      options.searches, options.real_searches, "mm/s", "lag", "baud", "rounding", "mean", "sigma",
      "worst", "stop ms", "mean", "sigma", "worst", "stop ms", "failed");
  std::size_t next = 0;
  std::map<std::string, int> failed;
  for (const int baud : options.bauds)
    for (const double lag : options.lags_ms)
      for (const double speed : options.speeds_mm_s) {
        const Setting setting{speed * 1e-3, lag * 1e-3, baud, options.space};
        const Line line{plan.touches[next++ % plan.touches.size()]};
        const auto seed = options.seed + static_cast<unsigned>(next);
        const Errors exact = on_virtual_wires(cell, line, setting, options.searches, seed);
        Errors real;
        if (options.real_searches > 0)
          real = on_real_wires(cell, line, setting, options.real_searches, seed);
        fmt::print(
            "{:>6} {:>6} {:>8} {:>9.2f} | {:>7.2f} {:>7.2f} {:>7.2f} {:>9.2f} | {:>7.2f} {:>7.2f} "
            "{:>7.2f} {:>9.2f} {:>7}\n",
            speed, lag, baud, rounding_um(truth, line), exact.mean(), exact.sigma(), exact.worst(),
            exact.slowest_reaction_ms(), real.mean(), real.sigma(), real.worst(),
            real.slowest_reaction_ms(),
            static_cast<std::size_t>(options.searches + options.real_searches) - exact.um.size() -
                real.um.size());
        std::fflush(stdout);
        for (const auto& [why, count] : exact.failed) failed["virtual: " + why] += count;
        for (const auto& [why, count] : real.failed) failed["wires: " + why] += count;
      }
  for (const auto& [why, count] : failed) fmt::print("not measured: {} ({})\n", count, why);
}

}  // namespace

int main(int argc, char** argv) {
  cellcal::CommandLine app{
      "Error of the latched contact point, on virtual and on real wires, RSI."};
  Options options;
  app.option("--speeds", options.speeds_mm_s, "Of the search [mm/s]").between(0.1, 20.0);
  app.option("--lags", options.lags_ms, "Of the arm behind its setpoint [ms]").between(0.0, 200.0);
  app.option("--bauds", options.bauds, "Of the sensor's line");
  app.option("--searches", options.searches, "Per row, virtual").between(2, 100'000);
  app.option("--real-searches", options.real_searches, "Per row, on real wires; 0: none")
      .between(0, 100'000);
  app.option("--space", options.space, "By corrections in space (RKorr)");
  app.option("--seed", options.seed, "Of lines and starts");
  if (const auto code = app.parse(argc, argv)) return *code;
  try {
    run(options);
  } catch (const std::exception& error) {
    fmt::print(stderr, "latch: {}\n", error.what());
    return 1;
  }
  return 0;
}
