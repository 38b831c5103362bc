// The control charts over checks: rate of false alarms, delay of detection, compared with the single check; and the
// limits themselves (--limits).

#include "calib/check/drift.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <numeric>
#include <optional>

#include "calib/check/charts.h"
#include "calib/check/tcp_check.h"
#include "calib/files/files.h"
#include "calib/files/robot_file.h"
#include "calib/identify/identify.h"
#include "calib/plan/check_plan.h"
#include "tests/command_line/command_line.h"
#include "tests/experiments/trial.h"

namespace {

using namespace cellcal;

constexpr double kChecksPerMonth = 90.0;  // one per shift
constexpr double kMonthS = 30.0 * 86400.0;
constexpr double kGrowthPerKelvin = 12e-6;

double mean(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) /
         static_cast<double>(std::max<std::size_t>(1, values.size()));
}

double quantile(std::vector<double> values, double share) {
  if (values.empty()) return std::nan("");
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
}

// ---- Limits -------------------------------------------------------------------------------------------------

/// For one run: each new maximum of a statistic, and the check at which it was reached.
struct Records {
  std::vector<std::pair<int, double>> highest;
  void update(int check, double value) {
    if (highest.empty() || value > highest.back().second) highest.emplace_back(check, value);
  }
  int first_beyond(double limit, int else_at) const {
    const auto at =
        std::ranges::find_if(highest, [&](const auto& one) { return one.second > limit; });
    return at == highest.end() ? else_at : at->first;
  }
};

struct Run {
  Records ewma, cusum;
};

Run unchanged_run(int length, std::uint64_t seed) {
  calib::Random random(seed);
  calib::Charts charts(std::nullopt);
  Run run;
  calib::CheckMeasurement check;
  for (int k = 1; k <= length; ++k) {
    for (double& one : check.shift_m) one = random.normal();
    const auto at = charts.take(check);
    charts.learn(check);
    if (k < static_cast<int>(calib::kLeastChecks)) continue;
    run.ewma.update(k, at.ewma);
    run.cusum.update(k, at.cusum);
  }
  return run;
}

double run_length(const std::vector<Run>& runs, const calib::ControlLimits& limits, int most) {
  double sum = 0.0;
  for (const Run& run : runs)
    sum += std::min(run.ewma.first_beyond(limits.ewma, most),
                    run.cusum.first_beyond(limits.cusum, most));
  return sum / static_cast<double>(runs.size());
}

double bisected(double low, double high, const std::function<double(double)>& length,
                double wanted) {
  for (int i = 0; i < 40; ++i) {
    const double middle = 0.5 * (low + high);
    (length(middle) < wanted ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

void print_limits(int count, std::uint64_t seed) {
  for (const double wanted : {200.0, 1000.0}) {
    const int most = static_cast<int>(12.0 * wanted);
    std::vector<Run> runs;
    for (int i = 0; i < count; ++i)
      runs.push_back(unchanged_run(most, seed + 7919u * static_cast<unsigned>(i)));
    const auto of_one = [&](double alone) {
      constexpr double kNever = 1e9;
      const double ewma = bisected(
          1, 9,
          [&](double l) {
            return run_length(runs, {l, kNever, 0}, most);
          },
          alone);
      const double cusum = bisected(
          1, 9,
          [&](double l) {
            return run_length(runs, {kNever, l, 0}, most);
          },
          alone);
      return calib::ControlLimits{ewma, cusum, wanted};
    };
    const double alone = bisected(
        wanted, 2.5 * wanted, [&](double a) { return run_length(runs, of_one(a), most); }, wanted);
    const calib::ControlLimits limits = of_one(alone);
    std::vector<double> lengths;
    for (const Run& run : runs)
      lengths.push_back(std::min(run.ewma.first_beyond(limits.ewma, most),
                                 run.cusum.first_beyond(limits.cusum, most)));
    fmt::print(
        "run length {:.0f}: ewma {:.3f}, cusum {:.3f} (each alone {:.0f}); by both {:.0f}, 5 % before {:.0f}, median {:.0f}\n",
        wanted, limits.ewma, limits.cusum, alone, run_length(runs, limits, most),
        quantile(lengths, 0.05), quantile(lengths, 0.5));
    std::fflush(stdout);
  }
}

// ---- Cells --------------------------------------------------------------------------------------------------

/// One calibrated arm, its check, and the single check's alarm after four that held.
struct Watched {
  experiments::World world;
  calib::Calibration calibration;
  calib::Plan plan;
  std::optional<calib::ShiftGauge> gauge;
  std::optional<calib::Foresight> foresight;
  std::optional<calib::Alarm> alarm;
};

std::vector<calib::Touch> expected(const calib::Plan& plan) {
  std::vector<calib::Touch> touches;
  for (const calib::PlannedTouch& planned : plan.touches) {
    calib::Touch touch;
    touch.target = planned.target;
    const double share = planned.expected_m / planned.search_m;
    for (std::size_t i = 0; i < planned.standoff.size(); ++i)
      touch.joint_rad.push_back(planned.standoff[i] +
                                share * (planned.end[i] - planned.standoff[i]));
    touches.push_back(std::move(touch));
  }
  return touches;
}

/// Changes of the cell, by months since its calibration.
struct Scenario {
  std::string name;
  std::function<Eigen::Vector3d(double months)> shift_m = [](double) {
    return Eigen::Vector3d(Eigen::Vector3d::Zero());
  };
  std::function<double(double months)> kelvin = [](double) { return 0.0; };
  bool temperature_known = false;
  double noise = 1.0;  ///< of the touches, relative to the stated one
  int begins = 0;      ///< at this check
  bool ends_with_chart =
      false;  ///< no change: the single check's alarms are counted until the chart's first
};

std::optional<std::vector<calib::Touch>> made(const Watched& on, const Scenario& scenario,
                                              double months, calib::Random& random) {
  experiments::World world = on.world;
  world.arm.knock(scenario.shift_m(months));
  world.arm.grow(kGrowthPerKelvin * scenario.kelvin(months));
  const double warm =
      scenario.temperature_known ? 0.5 : random.uniform();  // as at some time of the calibration
  std::vector<calib::Touch> touches;
  for (const calib::PlannedTouch& planned : on.plan.touches) {
    auto touch = world.touch(planned, warm, experiments::kBeyond, random);
    if (!touch) return std::nullopt;
    if (scenario.noise > 1.0) {  // not yet added by the world
      const double more =
          0.03e-3 * std::sqrt(scenario.noise * scenario.noise - 1.0) * random.normal();
      const double length = planned.search_m;
      for (std::size_t i = 0; i < touch->joint_rad.size(); ++i)
        touch->joint_rad[i] += more / length * (planned.end[i] - planned.standoff[i]);
    }
    touches.push_back(std::move(*touch));
  }
  return touches;
}

std::optional<Watched> watched(const calib::Robot& robot, const experiments::Trial& trial,
                               std::uint64_t seed) {
  auto session = experiments::measured(robot, trial, seed);
  if (!session) return std::nullopt;
  calib::Calibration c =
      calib::identify(session->world.cell, session->touches, {}, calib::shipped_robots);
  if (!c.verdict.publish()) return std::nullopt;
  calib::Plan plan = calib::make_check_plan(c, {}, {});
  Watched on{std::move(session->world), std::move(c), std::move(plan), {}, {}, {}};
  const auto touches = expected(on.plan);
  on.gauge.emplace(on.calibration, touches);
  on.foresight = calib::foresee(on.calibration, touches);
  calib::Random random(seed + 3);
  Eigen::MatrixXd off(static_cast<Eigen::Index>(touches.size()), 4);
  for (int k = 0; k < 4; ++k) {
    const auto before = made(on, {}, 0.0, random);
    if (!before) return std::nullopt;
    off.col(k) = on.gauge->measure(*before).off_m;
  }
  calib::refer_to(*on.foresight, off);
  on.alarm.emplace(calib::possible_changes(on.calibration, on.foresight->contacts),
                   on.foresight->contacts, on.foresight->covariance_m2());
  return on;
}

/// Number of checks from the beginning of the change to the first alarm of chart and single check; `most`: no alarm by then.
struct Delay {
  double chart = 0.0, single = 0.0;
  bool false_alarm = false;  ///< of the chart, before it began
  int single_alarms = 0;     ///< without a change
};

Delay run_of(const Watched& on, const Scenario& scenario, int most, calib::Random& random) {
  std::optional<double> reference_c;
  if (scenario.temperature_known) reference_c = 20.0 + scenario.kelvin(0.0);
  calib::Charts charts(reference_c);
  Delay delay{static_cast<double>(most), static_cast<double>(most)};
  bool chart = false, single = false;
  for (int k = 1; k <= scenario.begins + most && !(chart && (single || scenario.ends_with_chart));
       ++k) {
    const double months = std::max(0, k - scenario.begins) / kChecksPerMonth;
    const auto touches = made(on, scenario, months, random);
    if (!touches) continue;
    const auto shift = on.gauge->measure(*touches);
    calib::CheckMeasurement check;
    check.session = k;
    check.time_s = k / kChecksPerMonth * kMonthS;
    check.shift_m = shift.shift_m;
    check.covariance_m2 = shift.covariance_m2;
    if (scenario.temperature_known) check.temperature_c = 20.0 + scenario.kelvin(months);
    if (!chart) {
      const auto at = charts.take(check);
      charts.learn(check);
      const bool beyond =
          at.ewma > calib::kAlarmLimits.ewma || at.cusum > calib::kAlarmLimits.cusum;
      if (k >= static_cast<int>(calib::kLeastChecks) && beyond) {
        chart = true;
        delay.false_alarm = k <= scenario.begins;
        delay.chart = k - scenario.begins;
      }
    }
    if (k <= scenario.begins || single) continue;
    Eigen::VectorXd off = shift.off_m;
    for (std::size_t t = 0; t < on.foresight->contacts.size(); ++t)
      off[static_cast<Eigen::Index>(t)] -= on.foresight->contacts[t].offset_m;
    if (on.alarm->log_odds(on.alarm->covariance().whitened(off)) <= on.alarm->threshold()) continue;
    ++delay.single_alarms;
    if (scenario.ends_with_chart) continue;
    single = true;
    delay.single = k - scenario.begins;
  }
  return delay;
}

void print_row(const Scenario& scenario, const std::vector<Delay>& delays, int most) {
  std::vector<double> chart, single;
  int never = 0, false_alarms = 0, single_alarms = 0;
  for (const Delay& one : delays) {
    false_alarms += one.false_alarm;
    single_alarms += one.single_alarms;
    if (one.false_alarm) continue;
    chart.push_back(one.chart);
    single.push_back(one.single);
    never += one.chart >= most;
  }
  fmt::print("{:<34} {:>5} {:>8.1f} {:>6.0f} {:>6.0f} {:>6.0f} {:>7} {:>10} | ", scenario.name,
             delays.size(), mean(chart), quantile(chart, 0.05), quantile(chart, 0.5),
             quantile(chart, 0.95), never, false_alarms);
  if (scenario.ends_with_chart)
    fmt::print("{} alarms in {:.0f} checks\n", single_alarms,
               mean(chart) * static_cast<double>(chart.size()));
  else
    fmt::print("{:>8.1f} {:>6.0f} {:>6.0f} {:>6.0f}\n", mean(single), quantile(single, 0.05),
               quantile(single, 0.5), quantile(single, 0.95));
  std::fflush(stdout);
}

Eigen::Vector3d any_direction(calib::Random& random) {
  return Eigen::Vector3d(random.normal(), random.normal(), random.normal()).normalized();
}

}  // namespace

int main(int argc, char** argv) {
  try {
    experiments::Trial trial;
    int arms = 6, runs = 12, runs_unchanged = 8, most = 5000, limit_runs = 20000;
    bool limits = false;
    std::uint64_t seed = 1;
    CommandLine app(
        "Control charts over checks: run length unchanged, delay of creeps and steps, beside the single check.\n"
        "Example: drift --arms 4 --runs 10\n         drift --limits");
    app.option("--arms", arms, "Random arms, each calibrated once");
    app.option("--runs", runs, "Of each arm and change");
    app.option("--runs-unchanged", runs_unchanged, "Of each arm with nothing changed");
    app.option("--most", most, "Checks of a run, nothing changed, at most");
    app.option("--seed", seed, "");
    app.option("--limits", limits, "Work out the limits instead");
    app.option("--limit-runs", limit_runs, "That they are worked out by");
    if (const auto code = app.parse(argc, argv)) return *code;
    if (limits) {
      print_limits(limit_runs, seed);
      return 0;
    }
    trial.gears = experiments::Gears::kSpectrum;
    trial.check = 10;
    const calib::Robot robot = calib::load_robot(CELLCAL_EXPERIMENT_ROBOT);
    std::vector<Watched> cells;
    for (std::uint64_t k = 0; static_cast<int>(cells.size()) < arms; ++k)
      if (auto one = watched(robot, trial, seed * 100000 + k)) cells.push_back(std::move(*one));
    fmt::print("{} arms, {} checks a month; checks until the first alarm\n", cells.size(),
               kChecksPerMonth);
    fmt::print("{:<34} {:>5} {:>8} {:>6} {:>6} {:>6} {:>7} {:>10} | {:>8} {:>6} {:>6} {:>6}\n",
               "what happens", "runs", "chart", "5 %", "50 %", "95 %", "never", "before it",
               "single", "5 %", "50 %", "95 %");
    std::fflush(stdout);
    constexpr int kBegins = 30;  // ten days
    const auto season = [](double months) { return 5.0 * std::sin(months / 12.0 * 2.0 * M_PI); };
    struct Row {
      std::string name;
      double creep_m = 0.0, step_m = 0.0;
      int begins = 0;
      bool season = false, known = false;
      double noise = 1.0;
    };
    for (const Row& row :
         {Row{"nothing"}, Row{.name = "nothing, touches scatter 1.5 x", .noise = 1.5},
          Row{.name = "season +-5 K, known", .season = true, .known = true},
          Row{.name = "season +-5 K, not known", .season = true},
          Row{"creep 0.02 mm/month", 0.02e-3, 0.0, kBegins},
          Row{"creep 0.05 mm/month", 0.05e-3, 0.0, kBegins},
          Row{"creep 0.10 mm/month", 0.1e-3, 0.0, kBegins},
          Row{"creep 0.05 mm/month at once", 0.05e-3, 0.0, 0},
          Row{"step 0.05 mm", 0.0, 0.05e-3, kBegins}, Row{"step 0.10 mm", 0.0, 0.1e-3, kBegins},
          Row{"step 0.15 mm", 0.0, 0.15e-3, kBegins}}) {
      const bool changes = row.creep_m > 0.0 || row.step_m > 0.0;
      std::vector<Delay> delays;
      calib::Random random(seed + 11);
      for (const Watched& cell : cells)
        for (int i = 0; i < (changes ? runs : runs_unchanged); ++i) {
          const Eigen::Vector3d along = any_direction(random);
          Scenario scenario;
          scenario.begins = row.begins;
          scenario.ends_with_chart = !changes;
          scenario.noise = row.noise;
          scenario.temperature_known = row.known;
          if (row.season) scenario.kelvin = season;
          if (changes)
            scenario.shift_m = [&](double months) {
              return Eigen::Vector3d(along *
                                     (row.creep_m * months + (months > 0.0 ? row.step_m : 0.0)));
            };
          delays.push_back(run_of(cell, scenario, changes ? 1200 : most, random));
        }
      Scenario named;
      named.name = row.name;
      named.ends_with_chart = !changes;
      print_row(named, delays, changes ? 1200 : most);
    }
    return 0;
  } catch (const std::exception& e) {
    std::fprintf(stderr, "drift: %s\n", e.what());
    return 1;
  }
}
