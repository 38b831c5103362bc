// Priors learned from a fleet of simulated arms whose true spreads differ from the robot file's; and their benefit for
// calibrations of further arms: touches and minutes to the required accuracy, true errors, and validity of the bounds.

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "calib/files/files.h"
#include "calib/files/robot_file.h"
#include "calib/identify/identify.h"
#include "calib/model/linear.h"
#include "calib/model/units.h"
#include "calib/priors/learn.h"
#include "tests/command_line/command_line.h"
#include "tests/experiments/trial.h"

namespace {

using namespace cellcal;
using experiments::median;

struct Given {
  int fleet = 200, touches = 40, online = 10, planned = 60, most = 200;
  double poisoned = 0.05, goal_mm = 0.15;
  std::uint64_t seed = 1;
  bool learn_only = false;
  std::string robot = CELLCAL_EXPERIMENT_ROBOT;
};

/// True spreads relative to the file's: some joints tighter, some wider.
experiments::Trial uneven_trial() {
  experiments::Trial trial;
  trial.length_factor = {0.3, 0.5, 1.6, 1.3, 0.4, 0.5};
  trial.angle_factor = {0.4, 0.5, 1.5, 0.5, 0.6, 1.2};
  return trial;
}

/// Length of the arm and of the tip, which the cell file states as exact: the last joint's errors include it.
double true_length_m(const experiments::Trial& trial, std::size_t joint, std::size_t joints) {
  const double arm = experiments::TruthSettings{}.length_sigma_m * trial.length_factor[joint];
  const double tip = experiments::TruthSettings{}.tip_offset_m / std::sqrt(3.0);  // uniform
  return joint + 1 == joints ? std::hypot(arm, tip) : arm;
}
double true_angle_rad(const experiments::Trial& trial, std::size_t joint, std::size_t joints) {
  constexpr double kTipFromFlangeM = 0.41;
  const double arm = experiments::TruthSettings{}.angle_sigma_rad * trial.angle_factor[joint];
  const double tip = experiments::TruthSettings{}.tip_offset_m / std::sqrt(3.0) / kTipFromFlangeM;
  return joint + 1 == joints ? std::hypot(arm, tip) : arm;
}

/// The true spreads entered in the file.
calib::Robot with_true_priors(calib::Robot robot, const experiments::Trial& trial) {
  constexpr double kTrueCompliance = 1e-5;  // TruthSettings
  for (std::size_t i = 0; i < robot.joints.size(); ++i) {
    calib::Joint& joint = robot.joints[i];
    joint.tolerance_length_m = true_length_m(trial, i, robot.joints.size());
    joint.tolerance_angle_rad = true_angle_rad(trial, i, robot.joints.size());
    if (joint.compliance_sigma_rad_per_nm > 0.0)
      joint.compliance_sigma_rad_per_nm = kTrueCompliance;
    // Two orders of equal variance, rms over a revolution in all.
    joint.harmonics = {1, 2};
    joint.harmonic_sigma_rad = trial.gear_arcsec / std::sqrt(2.0) * calib::kRadPerArcsec;
  }
  return robot;
}

std::vector<calib::ArmEvidence> fleet_evidence(const calib::Robot& robot, const Given& given,
                                               experiments::Trial trial, int& withheld) {
  trial.fit = given.touches;
  trial.check = 8;
  std::vector<calib::ArmEvidence> all;
  for (std::uint64_t k = 0; static_cast<int>(all.size()) < given.fleet && k < 3000; ++k) {
    const auto session = experiments::measured(robot, trial, given.seed * 100'000 + k);
    if (!session) continue;
    const auto c =
        calib::identify(session->world.cell, session->touches, {}, calib::shipped_robots);
    auto evidence = calib::evidence_of(c);
    if (auto* one = std::get_if<calib::ArmEvidence>(&evidence)) {
      one->name = fmt::format("arm {:03}", all.size());
      all.push_back(std::move(*one));
    } else {
      ++withheld;
    }
  }
  return all;
}

/// Some are wrong: errors times a hundred, times three, with the opposite sign and overconfident, and unchanged.
std::vector<calib::ArmEvidence> poisoned(std::vector<calib::ArmEvidence> arms, double share) {
  const auto count =
      static_cast<std::size_t>(std::lround(share * static_cast<double>(arms.size())));
  for (std::size_t k = 0; k < count; ++k) {
    calib::ArmEvidence& arm = arms[k * arms.size() / count];
    switch (k % 4) {
      case 0: arm.values *= 100.0; break;
      case 1: arm.values *= 3.0; break;
      case 2:
        arm.values *= -1000.0;
        arm.rows *= 500.0;
        break;
      default: arm.values.setZero();
    }
  }
  return arms;
}

void print_spreads(const calib::Robot& robot, const experiments::Trial& trial,
                   const calib::Learned& clean, const calib::Learned& dirty) {
  fmt::print("joint        file   truth   fleet +- sigma   offered   arms   poisoned, by sigmas\n");
  for (std::size_t i = 0; i < robot.joints.size(); ++i)
    for (const auto kind : {calib::SpreadKind::kLength, calib::SpreadKind::kAngle,
                            calib::SpreadKind::kCompliance, calib::SpreadKind::kGear}) {
      const auto& s = clean.priors.joints[i].of(kind);
      const auto& p = dirty.priors.joints[i].of(kind);
      if (!s || !p) continue;
      const bool length = kind == calib::SpreadKind::kLength,
                 angle = kind == calib::SpreadKind::kAngle;
      const double unit = length                                   ? 1e3
                          : angle                                  ? calib::kDegPerRad
                          : kind == calib::SpreadKind::kCompliance ? 1e6
                                                                   : 1.0 / calib::kRadPerArcsec;
      const double truth = length  ? true_length_m(trial, i, robot.joints.size())
                           : angle ? true_angle_rad(trial, i, robot.joints.size())
                           : kind == calib::SpreadKind::kCompliance
                               ? 1e-5
                               : trial.gear_arcsec / std::sqrt(2.0) * calib::kRadPerArcsec;
      fmt::print("{} {:<9} {:7.4f} {:7.4f} {:7.4f} +- {:.4f} {:8.4f} {:7.1f} {:8.2f}\n",
                 robot.joints[i].name,
                 length                                   ? "mm"
                 : angle                                  ? "deg"
                 : kind == calib::SpreadKind::kCompliance ? "urad/Nm"
                                                          : "arcsec",
                 s->drawn * unit, truth * unit, s->found * unit, s->found_sigma * unit,
                 calib::offered(*s) * unit, s->arms, (p->found - s->found) / s->found_sigma);
    }
}

/// One set of priors, and the results of the arms calibrated with it.
struct Column {
  Column(std::string its_name, calib::Robot its_robot)
      : name(std::move(its_name)), robot(std::move(its_robot)) {}
  std::string name;
  calib::Robot robot;
  std::vector<experiments::OnlineOutcome> online;
  std::vector<experiments::Outcome> planned;
};

using Columns = std::vector<Column>;

/// An arm counts if its cell is feasible with all priors.
template <class Outcomes, class Run>
void run_arms(int wanted, const char* what, Columns& columns, Outcomes Column::*outcomes,
              const Run& run) {
  int arms = 0;
  for (std::uint64_t k = 0; arms < wanted && k < 1000; ++k) {
    Outcomes of_arm;
    for (const Column& c : columns) {
      auto o = run(c.robot, k);
      if (!o) break;
      of_arm.push_back(std::move(*o));
    }
    if (of_arm.size() < columns.size()) continue;
    ++arms;
    for (std::size_t i = 0; i < columns.size(); ++i)
      (columns[i].*outcomes).push_back(std::move(of_arm[i]));
    std::fprintf(stderr, "%s: %d of %d arms\n", what, arms, wanted);
  }
}

double worst(const std::vector<double>& v) { return *std::max_element(v.begin(), v.end()); }
double least(const std::vector<double>& v) { return *std::min_element(v.begin(), v.end()); }

template <class T, class Of>
std::vector<double> each(const std::vector<T>& all, const Of& of) {
  std::vector<double> values;
  for (const T& one : all) values.push_back(of(one));
  return values;
}

/// Median and worst of the touches and minutes to a u95; all of them for arms that did not reach it.
void print_to(double u95_mm, const Column& c) {
  std::vector<double> touches, minutes;
  int reached = 0;
  for (const auto& o : c.online) {
    const auto at = std::ranges::find_if(
        o.u95_by_touch_m, [&](double u95) { return u95 > 0.0 && u95 <= 1e-3 * u95_mm; });
    const bool there = at != o.u95_by_touch_m.end();
    const auto k = static_cast<std::size_t>(at - o.u95_by_touch_m.begin()) - (there ? 0 : 1);
    touches.push_back(static_cast<double>(k + 1));
    minutes.push_back(o.minutes_by_touch[k]);
    reached += there ? 1 : 0;
  }
  fmt::print("{:<18} {:.2f}   {:4.0f} {:4.0f}   {:5.1f} {:5.1f}   {:2d} of {}\n", c.name, u95_mm,
             median(touches), worst(touches), median(minutes), worst(minutes), reached,
             c.online.size());
}

void print_outcomes(const char* name, const std::vector<experiments::Outcome>& all) {
  using experiments::Outcome;
  const auto mean = each(all, [](const Outcome& o) { return 1e3 * o.m3; });
  const auto inside = each(all, [](const Outcome& o) { return 100.0 * o.m4; });
  const auto u95 = each(all, [](const Outcome& o) { return 1e3 * o.u95; });
  fmt::print(
      "{:<18} {:.3f} {:.3f}   {:.3f}   {:.3f}   {:5.1f} {:5.1f}   {:3d} of {}   {:.2f}   {}\n",
      name, median(mean), worst(mean),
      worst(each(all, [](const Outcome& o) { return 1e3 * o.m3_max; })), median(u95),
      median(inside), least(inside),
      std::ranges::count_if(inside, [](double v) { return v >= 95.0; }), all.size(),
      median(each(all, [](const Outcome& o) { return o.u95 / o.rms; })),
      std::ranges::count(all, true, &Outcome::published));
}

void print_head(const std::string& what) {
  fmt::print(
      "{}\npriors             true M3 mm, max mm      u95 mm  inside u95 %   95 % inside  u95/rms  let through\n",
      what);
}

void run_fresh(const Given& given, experiments::Trial trial, Columns& columns) {
  const std::uint64_t first = given.seed * 100'000 + 50'000;
  run_arms(given.online, "touch by touch", columns, &Column::online,
           [&](const calib::Robot& robot, std::uint64_t k) {
             return experiments::run_online(robot, trial, {given.goal_mm * 1e-3, given.most, 0.0},
                                            0.0, first + k);
           });
  fmt::print(
      "touch by touch, {} fresh arms, at most {} touches\npriors             u95 mm  touches     minutes     reached\n",
      given.online, given.most);
  for (const double mark : {0.4, 0.3, 0.2, given.goal_mm})
    for (const Column& c : columns) print_to(mark, c);
  print_head("at their end");
  for (const Column& c : columns)
    print_outcomes(c.name.c_str(), [&] {
      std::vector<experiments::Outcome> all;
      for (const auto& o : c.online) all.push_back(o.outcome);
      return all;
    }());
  std::fflush(stdout);
  trial.fit = given.touches;
  trial.check = 8;
  run_arms(given.planned, "planned", columns, &Column::planned,
           [&](const calib::Robot& robot, std::uint64_t k) {
             return experiments::run(robot, trial, first + 10'000 + k);
           });
  print_head(fmt::format("{} planned touches, {} fresh arms", given.touches, given.planned));
  for (const Column& c : columns) print_outcomes(c.name.c_str(), c.planned);
}

void print_set_aside(const char* of, const calib::Learned& learned) {
  fmt::print("{}: {} arms behind the priors", of, learned.priors.arms);
  for (const calib::SetAsideKind kind : all_values<calib::SetAsideKind>())
    if (const auto n = std::ranges::count(learned.set_aside, kind, &calib::SetAside::kind))
      fmt::print("; {} {}", n, calib::to_string(kind));
  fmt::print("\n");
}

void run(const Given& given) {
  const calib::Robot robot = calib::load_robot(given.robot);
  const experiments::Trial trial = uneven_trial();
  int withheld = 0;
  const auto arms = fleet_evidence(robot, given, trial, withheld);
  const auto begin = std::chrono::steady_clock::now();
  const calib::Learned clean = calib::learn(robot, arms);
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
  const calib::Learned dirty = calib::learn(robot, poisoned(arms, given.poisoned));
  fmt::print("{} published calibrations of {} touches, {} withheld; learned in {:.1f} s\n",
             arms.size(), given.touches, withheld, took.count());
  print_set_aside("clean", clean);
  print_set_aside("poisoned", dirty);
  if (clean.none || dirty.none) throw std::runtime_error("no priors came of these arms");
  print_spreads(robot, trial, clean, dirty);
  if (given.learn_only) return;
  std::fflush(stdout);
  const auto taken = [&](const calib::Learned& learned) {
    return std::get<calib::Accepted>(calib::accept(robot, learned.priors)).robot;
  };
  Columns columns;
  columns.emplace_back("file's", robot);
  columns.emplace_back("fleet's", taken(clean));
  columns.emplace_back("poisoned fleet's", taken(dirty));
  columns.emplace_back("truth's", with_true_priors(robot, trial));
  run_fresh(given, trial, columns);
}

}  // namespace

int main(int argc, char** argv) {
  try {
    Given given;
    cellcal::CommandLine app(
        "What priors learned from a fleet are worth to fresh arms of the model.\n"
        "Example: fleet_priors --fleet 50 --online 2 --planned 10");
    app.option("--fleet", given.fleet, "Arms to learn from").between(3, 1000);
    app.option("--touches", given.touches, "Of each").between(20, 400);
    app.option("--online", given.online, "Fresh arms, touch by touch to the goal").between(1, 1000);
    app.option("--planned", given.planned, "Fresh arms of as many planned touches as the fleet's")
        .between(1, 1000);
    app.option("--goal", given.goal_mm, "u95, mean over the workspace [mm]");
    app.option("--most", given.most, "Touches at most");
    app.option("--poisoned", given.poisoned, "Share of the fleet that lies").between(0.0, 0.2);
    app.option("--seed", given.seed, "");
    app.option("--robot", given.robot, "Robot file");
    app.option("--learn-only", given.learn_only, "Spreads alone");
    if (const auto code = app.parse(argc, argv)) return *code;
    run(given);
    return 0;
  } catch (const std::exception& e) {
    std::fprintf(stderr, "fleet_priors: %s\n", e.what());
    return 1;
  }
}
