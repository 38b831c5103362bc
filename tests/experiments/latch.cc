// Error of the latched joint angles relative to the true position of the tip at its contact with
// the sphere: the adapters and the sensor's driver as in the daemon, the emulated controller with
// its lag, the emulated sensor with its clock and line, an arm without errors. Prints figures; no
// threshold.
//
// The error is the gap between tip and surface at the latched angles: positive before the contact.
// Angles have four decimals, as from a controller with Precision 4.
//
// --budget: cost of a faster search, in virtual time. Many lines on all four spheres; every eighth
// touch is confirmed at 2 mm/s, as in sessions. Overtravel is the depth of the tip below the surface
// when the arm rests; the emulated sphere yields, a real one reacts with stiffness times depth.

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
#include "calib/identify/identify_once.h"
#include "calib/model/linear.h"
#include "calib/model/parameter_key.h"
#include "calib/plan/plan.h"
#include "daemon/backends/virtual_cell.h"
#include "daemon/config/config.h"
#include "drivers/contact/serial_contact.h"
#include "drivers/io_thread.h"
#include "drivers/kuka/rsi/rsi_robot.h"
#include "sim/cell/physical_cell.h"
#include "sim/krc/krc_udp.h"
#include "sim/mcu/mcu_thread.h"
#include "tests/command_line/command_line.h"
#include "tests/drivers/said.h"

namespace {

using namespace cellcal;           // NOLINT: an experiment's own file
using namespace cellcal::drivers;  // NOLINT
using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr double kRadPerDeg = std::numbers::pi / 180;
constexpr milliseconds kPollInterval{1};
constexpr seconds kTimeout{20}, kArmLifetime{20};
constexpr double kRunUpM = 0.002, kRunUpSpreadM = 0.0005, kBeyondM = 0.003;
/// Upper limit, from 12 mm/s on: at 40 mm/s the arm reaches its speed within 2 mm.
constexpr double kMostRunUpM = 0.008;
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
  std::vector<double> um, reaction_ms, overtravel_mm;
  std::vector<AxisAngles> latched_rad;
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

/// A search line: joint angles as a function of the tip's travel from the stand-off.
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

/// Both sides of the interfaces.
struct Rig {
  Robot& robot;
  ContactSensor& contact;
  Clock& clock;
  const sim::PhysicalCell& truth;
};

bool eventually(Clock& clock, const std::function<bool()>& done) {
  const TimePoint end = clock.now() + kTimeout;
  while (!done()) {
    if (clock.now() > end) return false;
    clock.sleep_until(clock.now() + kPollInterval);
  }
  return true;
}

/// Empty, or the reason why one of them is not ready.
std::string make_ready(Rig& rig) {
  if (!eventually(rig.clock, [&] { return rig.contact.status().link == ContactLink::kReady; }))
    return drivers::said(rig.contact.status().words);
  const bool ready = eventually(rig.clock, [&] {
    if (rig.robot.state().link == RobotLink::kNotReferenced) {
      rig.robot.rereference();
      rig.clock.sleep_until(rig.clock.now() + milliseconds{20});
    }
    return rig.robot.state().link == RobotLink::kReady;
  });
  return ready ? "" : drivers::said(rig.robot.state().words);
}

std::optional<MoveResult> move(Rig& rig, const Move& what) {
  rig.robot.begin(what);
  std::optional<MoveResult> result;
  eventually(rig.clock, [&] { return (result = rig.robot.poll()).has_value(); });
  return result;
}

/// Searches along one line, each from a different distance to the surface, so that contact occurs
/// at any time of the cycle.
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
    // Constant speed is reached before the contact.
    const double run_up = kRunUpM + std::min(kMostRunUpM, speed_m_s * speed_m_s / 0.02);
    const double from = line.touch.expected_m - run_up - kRunUpSpreadM * random.uniform();
    const Move back{++move_id, in_contact ? MoveKind::kRetreat : MoveKind::kTransit, line.at(from),
                    std::max(1e-3, std::abs(at_m - from)) / kTransitMS, 0};
    const auto there = move(rig, back);
    at_m = from;
    if (!there || there->outcome != MoveOutcome::kArrived) {
      ++errors.failed[there ? drivers::said(there->detail) : "no end of the way back"];
      continue;
    }
    in_contact = false;
    if (!eventually(rig.clock, [&] { return rig.contact.status().in_contact == false; })) {
      ++errors.failed["still in contact"];
      continue;
    }
    rig.contact.arm(++arm_id, kArmLifetime);
    std::optional<ArmResult> armed;
    eventually(rig.clock, [&] { return (armed = rig.contact.poll_arm()).has_value(); });
    if (!armed || !armed->armed) {
      ++errors.failed[armed ? drivers::said(armed->why_not) : "no answer to arm()"];
      continue;
    }
    const double to = line.touch.expected_m + kBeyondM;
    const auto result =
        move(rig, {++move_id, MoveKind::kSearch, line.at(to), (to - from) / speed_m_s, arm_id});
    in_contact = true;
    at_m = line.touch.expected_m;
    if (!result || result->outcome != MoveOutcome::kContact || !result->latch) {
      ++errors.failed[result ? std::string(to_string(result->outcome)) + ": " +
                                   drivers::said(result->detail)
                             : "no end of the search"];
      continue;
    }
    const auto& latched = result->latch->contact_rad;
    errors.um.push_back(1e6 *
                        rig.truth.gap_m(std::span<const double>(latched.data(), latched.size())));
    errors.reaction_ms.push_back(1e3 * result->latch->reaction_s);
    const auto& settled = result->latch->settled_rad;
    errors.overtravel_mm.push_back(
        -1e3 * rig.truth.gap_m(std::span<const double>(settled.data(), settled.size())));
    errors.latched_rad.push_back(latched);
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

/// Idle machine, direct cables, exact clocks: the error of the method itself.
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
        watch.update(now, now + c.cycle(), [&](TimePoint t) { return c.actual_rad_at(t); });
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

/// Change of the gap by the controller's rounding of the angles, 1 sigma: the lower limit of any
/// latch.
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
  std::vector<double> speeds_mm_s{1, 2, 5, 10}, budget_speeds_mm_s{10, 15, 20, 30, 40};
  std::vector<double> lags_ms{10, 20, 40};
  std::vector<int> bauds{115'200, 1'000'000};
  int searches = 100, real_searches = 15;
  unsigned seed = 1;
  bool space = false, budget = false;
  int budget_touches = 96;
  double stiffness_n_mm = 50.0, delay_sigma_ms = 0.2;
};

calib::Cell cell_of_known_spheres() {
  calib::Cell cell = calib::load_cell(CELLCAL_DEMO_CELL);
  for (calib::Target& target : cell.targets) target.diameter_sigma_m = 0.0;  // the true one
  return cell;
}

/// Session data, and their true values.
struct Made {
  std::vector<calib::Touch> touches;
  std::vector<double> gap_um;  ///< at the latched angles
};

/// Error of the estimated contacts: at the latched angles, corrected by the identified delay.
struct Left {
  double rms_um = 0.0, worst_um = 0.0, delay_ms = 0.0, radius_um = 0.0;
};

Left left_by_estimate(calib::Cell cell, const Made& made, double delay_sigma_s) {
  cell.latch_delay_sigma_s = delay_sigma_s;
  const calib::Calibration found = calib::identify_single_pass(cell, made.touches);
  const double delay_s = calib::correction_of(found, calib::latch_delay_parameter());
  Left left;
  left.delay_ms = 1e3 * delay_s;
  left.radius_um =
      1e6 *
      calib::correction_of(found, calib::tool_parameter(calib::ParameterKind::kEffectiveRadius, 0));
  for (std::size_t i = 0; i < made.touches.size(); ++i) {
    const double um = made.gap_um[i] + 1e6 * delay_s * made.touches[i].speed_m_s;
    left.rms_um += um * um / static_cast<double>(made.touches.size());
    if (std::abs(um) > std::abs(left.worst_um)) left.worst_um = um;
  }
  left.rms_um = std::sqrt(left.rms_um);
  return left;
}

double mean_of(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double value : values) sum += value;
  return values.empty() ? 0.0 : sum / static_cast<double>(values.size());
}

/// One row: all touches of a plan at one speed; confirmed ones at 2 mm/s.
void budget_row(const calib::Cell& cell, const calib::Plan& plan, double speed_mm_s, double lag_ms,
                const Options& options) {
  constexpr double kSlowMS = 0.002;
  constexpr std::size_t kConfirmEvery = 8;
  constexpr int kOnce = 1;
  Errors fast;
  Made made;
  for (std::size_t i = 0; i < plan.touches.size(); ++i) {
    const Line line{plan.touches[i]};
    Setting setting{speed_mm_s * 1e-3, lag_ms * 1e-3, options.bauds.back(), options.space};
    const auto seed = options.seed + static_cast<unsigned>(i);
    const Errors at_speed = on_virtual_wires(cell, line, setting, kOnce, seed);
    fast.um.insert(fast.um.end(), at_speed.um.begin(), at_speed.um.end());
    fast.overtravel_mm.insert(fast.overtravel_mm.end(), at_speed.overtravel_mm.begin(),
                              at_speed.overtravel_mm.end());
    for (const auto& [why, count] : at_speed.failed) fast.failed[why] += count;
    const bool confirmed = i % kConfirmEvery == 0;
    if (confirmed) setting.speed_m_s = kSlowMS;
    const Errors kept = confirmed ? on_virtual_wires(cell, line, setting, kOnce, seed) : at_speed;
    if (kept.um.empty()) continue;
    calib::Touch touch;
    touch.joint_rad.assign(kept.latched_rad[0].begin(), kept.latched_rad[0].end());
    touch.target = plan.touches[i].target;
    touch.speed_m_s = setting.speed_m_s;
    made.touches.push_back(touch);
    made.gap_um.push_back(kept.um[0]);
  }
  const double worst_mm = fast.overtravel_mm.empty() ? 0.0
                                                     : *std::max_element(fast.overtravel_mm.begin(),
                                                                         fast.overtravel_mm.end());
  const Left without = left_by_estimate(cell, made, 0.0);
  const Left with = left_by_estimate(cell, made, options.delay_sigma_ms * 1e-3);
  fmt::print(
      "{:>6} {:>6} | {:>7.2f} {:>7.2f} {:>7.2f} | {:>7.3f} {:>7.3f} {:>8.1f} | {:>7.2f} {:>7.2f} {:>8.2f} | "
      "{:>7.2f} {:>7.2f} {:>8.2f} {:>8.3f}\n",
      speed_mm_s, lag_ms, fast.mean(), fast.sigma(), fast.worst(), mean_of(fast.overtravel_mm),
      worst_mm, options.stiffness_n_mm * worst_mm, without.rms_um, without.worst_um,
      without.radius_um, with.rms_um, with.worst_um, with.radius_um, with.delay_ms);
  for (const auto& [why, count] : fast.failed)
    fmt::print("       not measured: {} ({})\n", count, why);
  std::fflush(stdout);
}

void run_budget(const Options& options) {
  const calib::Cell cell = cell_of_known_spheres();
  calib::PlanOptions how;
  how.fit_touches = options.budget_touches;
  how.check_touches = 0;
  how.seed = options.seed;
  const calib::Plan plan = calib::make_plan(cell, how);
  fmt::print(
      "{} touches a row, virtual time, sensor at {} baud; every eighth made at 2 mm/s for the estimates.\n"
      "gap: tip to surface at the latched angles, um, positive before the contact. overtravel: mm into the\n"
      "sphere at rest; force at worst, N, at {:g} N/mm. left: of the contacts by the estimate beside the true\n"
      "ones, um, and of the effective radius; delay not an unknown, then with the prior 0 +- {:g} ms.\n\n"
      "{:>6} {:>6} | {:>7} {:>7} {:>7} | {:>7} {:>7} {:>8} | {:>7} {:>7} {:>8} | {:>7} {:>7} {:>8} {:>8}\n",
      plan.touches.size(), options.bauds.back(), options.stiffness_n_mm, options.delay_sigma_ms,
      "mm/s", "lag", "mean", "sigma", "worst", "mean", "worst", "force", "rms", "worst", "radius",
      "rms", "worst", "radius", "delay ms");
  for (const double lag : options.lags_ms)
    for (const double speed : options.budget_speeds_mm_s)
      budget_row(cell, plan, speed, lag, options);
}

void run(const Options& options) {
  const calib::Cell cell = cell_of_known_spheres();
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
  app.option("--speeds", options.speeds_mm_s, "Of the search [mm/s]").between(0.1, 50.0);
  app.option("--lags", options.lags_ms, "Of the arm behind its setpoint [ms]").between(0.0, 200.0);
  app.option("--bauds", options.bauds, "Of the sensor's line");
  app.option("--searches", options.searches, "Per row, virtual").between(2, 100'000);
  app.option("--real-searches", options.real_searches, "Per row, on real wires; 0: none")
      .between(0, 100'000);
  app.option("--space", options.space, "By corrections in space (RKorr)");
  app.option("--budget", options.budget,
             "Overtravel, force and what the estimate leaves, by speed");
  app.option("--budget-speeds", options.budget_speeds_mm_s, "Of the search [mm/s]")
      .between(0.1, 50.0);
  app.option("--budget-touches", options.budget_touches, "Per row, of all spheres")
      .between(16, 1000);
  app.option("--stiffness", options.stiffness_n_mm, "Of tool and sphere's stand in series [N/mm]")
      .between(0.1, 10'000.0);
  app.option("--delay-sigma-ms", options.delay_sigma_ms, "Prior of the delay as an unknown [ms]")
      .between(0.001, 100.0);
  app.option("--seed", options.seed, "Of lines and starts");
  if (const auto code = app.parse(argc, argv)) return *code;
  try {
    if (options.budget)
      run_budget(options);
    else
      run(options);
  } catch (const std::exception& error) {
    fmt::print(stderr, "latch: {}\n", error.what());
    return 1;
  }
  return 0;
}
