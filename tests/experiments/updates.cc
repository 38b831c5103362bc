// Recalibration by a few touches based on the last calibration: accuracy of the result, number of touches
// and seconds, share of published results with a wrong cause, and cases given up.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <optional>

#include "calib/files/files.h"
#include "calib/files/robot_file.h"
#include "calib/identify/identify.h"
#include "calib/identify/update.h"
#include "calib/model/linear.h"
#include "calib/plan/check_plan.h"
#include "calib/plan/duration.h"
#include "tests/command_line/command_line.h"
#include "tests/experiments/happening.h"
#include "tests/experiments/trial.h"

namespace {

using namespace cellcal;
using calib::ChangeKind, calib::UpdateOutcome;
using experiments::Gears, experiments::Happening, experiments::OverPostures;

constexpr double kMonths = 1.0;

/// One arm, its calibration, the first touches of an update and a full session of as many touches.
struct Calibrated {
  experiments::World world;
  calib::Calibration calibration;
  calib::Plan first, full;
  OverPostures before;
};

double seconds_of(const calib::Plan& plan, const calib::Robot& robot) {
  calib::Pace pace;
  pace.predicted_m = calib::first_update_touches().before_m;
  return calib::duration_s(plan, robot, pace);
}

std::vector<calib::JointVector> judged_in(const calib::Cell& cell) {
  return experiments::postures(calib::ArmModel(cell.robot, cell.tool), 1000, 99);
}

OverPostures judged(const experiments::World& world, const calib::Calibration& c) {
  return experiments::judge(world.arm, calib::Predictor(c), judged_in(world.cell));
}

std::optional<Calibrated> calibrated(const calib::Robot& robot, const experiments::Trial& trial,
                                     std::uint64_t seed) {
  auto session = experiments::measured(robot, trial, seed);
  if (!session) return std::nullopt;
  calib::Calibration c =
      calib::identify(session->world.cell, session->touches, {}, calib::shipped_robots);
  if (!c.verdict.publish()) return std::nullopt;
  calib::PlanOptions as_many;
  as_many.fit_touches = calib::kMostUpdateTouches;
  as_many.check_touches = 0;
  calib::Plan first = calib::make_check_plan(c, {}, calib::first_update_touches());
  calib::Plan full = calib::make_plan(session->world.cell, as_many);
  const OverPostures before = judged(session->world, c);
  return Calibrated{std::move(session->world), std::move(c), std::move(first), std::move(full),
                    before};
}

/// False if one missed, or was in contact before its search began.
bool touch(const experiments::World& world, const calib::Plan& plan, double warm,
           calib::Random& random, std::vector<calib::Touch>& touches) {
  for (const calib::PlannedTouch& planned : plan.touches) {
    // The arm's first millimetre is no search.
    auto made = world.touch(planned, warm, 0.0, random);
    if (!made) return false;
    touches.push_back(std::move(*made));
  }
  return true;
}

struct Result {
  std::string done;
  std::vector<experiments::Happening> happenings;
  UpdateOutcome outcome = UpdateOutcome::kNotFound;
  bool met = true, right = false;
  std::string explanation;
  std::size_t touches = 0, set_aside = 0;
  double seconds = 0.0;
  OverPostures before, changed, after, full;
  double by_chance = 1.0, log_odds_second = 0.0, probability = 0.0, reached = 0.0;
  bool full_failed = false;
};

Result updated(const Calibrated& on, const std::vector<Happening>& happenings, std::uint64_t seed,
               bool with_full) {
  calib::Random random(seed);
  experiments::World world = on.world;
  Result result;
  result.happenings = happenings;
  experiments::Happened happened;
  for (const Happening& one : happenings) {
    if (!result.done.empty()) result.done += " + ";
    result.done += name_of(one);
    happened = experiments::happen(one, world, random);
  }
  result.before = on.before;
  result.changed = judged(world, on.calibration);
  const double warm = random.uniform();
  std::vector<calib::Touch> touches;
  const calib::Robot& robot = world.cell.robot;
  result.seconds = seconds_of(on.first, robot);
  calib::Calibration c;
  const auto refit = [&] { c = calib::update(on.calibration, touches, {"", kMonths}); };
  result.met = touch(world, on.first, warm, random, touches);
  if (result.met) {
    refit();
    if (calib::further_touches_pay(*c.update)) {
      const auto how =
          calib::further_update_touches(static_cast<int>(touches.size()), result.seconds);
      const calib::Plan further =
          calib::make_update_plan(c, {}, how, on.first.touches.back().clear);
      result.seconds += seconds_of(further, robot);
      result.met = touch(world, further, warm, random, touches);
      if (result.met) refit();
    }
  }
  result.touches = touches.size();
  if (result.met) {
    result.outcome = c.update->outcome;
    const calib::Explanation& first = c.update->explanations.front();
    result.right = first.kind == happenings.front().kind &&
                   (happened.which.empty() || happened.which == first.name);
    result.explanation = fmt::format("{} {} {:.3f}/{:.3f}", to_string(first.kind), first.name,
                                     1e3 * first.shift_m.norm(), 1e3 * first.amount);
    result.probability = first.probability;
    result.by_chance = c.update->by_chance;
    result.log_odds_second = c.update->log_odds_second;
    result.set_aside = c.update->set_aside.size();
    result.reached = c.update->reached_m / c.update->before_m;
    result.after = judged(world, c);
  }
  if (!with_full) return result;
  std::vector<calib::Touch> of_full;
  for (const calib::PlannedTouch& planned : on.full.touches)
    if (auto made = world.touch(planned, warm, experiments::kBeyond, random))
      of_full.push_back(std::move(*made));
  result.full = judged(world, calib::identify(world.cell, of_full));
  return result;
}

double log_uniform(double low, double high, calib::Random& random) {
  return low * std::pow(high / low, random.uniform());
}

Happening drawn(ChangeKind kind, calib::Random& random) {
  switch (kind) {
    case ChangeKind::kTool: return {kind, log_uniform(0.2e-3, 3e-3, random)};
    case ChangeKind::kSphere: return {kind, log_uniform(0.5e-3, 5e-3, random)};
    case ChangeKind::kJoint: return {kind, log_uniform(0.3e-3, 3e-3, random)};
    case ChangeKind::kGrowth: return {kind, log_uniform(100e-6, 300e-6, random)};
    default: return {};
  }
}

std::vector<double> sorted(std::vector<double> v) {
  std::sort(v.begin(), v.end());
  return v;
}

void print(const std::string& title, const std::vector<const Result*>& rows) {
  if (rows.empty()) return;
  std::map<std::string, int> outcomes;
  std::vector<double> ratio, worst, after, max, before, before_max, touches, seconds, covered, full,
      changed;
  int false_resolutions = 0, wrong = 0, within = 0, published = 0, full_within = 0;
  for (const Result* r : rows) {
    ++outcomes[r->met ? to_string(r->outcome) : "not met"];
    changed.push_back(1e3 * r->changed.mean);
    if (r->full.mean > 0.0) {
      full.push_back(1e3 * r->full.mean);
      full_within += r->full.mean <= calib::kUpdateGoal * r->before.mean;
    }
    if (!r->met || r->outcome != UpdateOutcome::kUpdated) continue;
    ++published;
    const bool good = r->after.mean <= calib::kUpdateGoal * r->before.mean;
    within += good;
    wrong += !r->right;
    false_resolutions += !good && (!r->right || r->happenings.size() > 1);
    ratio.push_back(r->after.mean / r->before.mean);
    worst.push_back(r->after.max / r->before.max);
    after.push_back(1e3 * r->after.mean);
    max.push_back(1e3 * r->after.max);
    before.push_back(1e3 * r->before.mean);
    before_max.push_back(1e3 * r->before.max);
    touches.push_back(static_cast<double>(r->touches));
    seconds.push_back(r->seconds);
    covered.push_back(100.0 * r->after.covered);
  }
  fmt::print("\n{}: {} cases;", title, rows.size());
  for (const auto& [name, count] : outcomes) fmt::print(" {} {}", name, count);
  fmt::print("\n");
  using experiments::median;
  if (published > 0) {
    fmt::print(
        "  published: touches {:.0f} (most {:.0f}), {:.1f} s (most {:.1f})\n"
        "  M3 mean/max mm, median: before {:.3f}/{:.3f}, after {:.3f}/{:.3f}; worst after {:.3f}/{:.3f}\n"
        "  M3 mean after over before: median {:.2f}, 90 % {:.2f}, worst {:.2f}; of max {:.2f}, worst {:.2f}; within a "
        "fifth {} of {}\n"
        "  wrong cause {}, false resolutions (wrong cause or two things, and worse than a fifth) {}\n"
        "  share inside u95: median {:.1f} %, worst {:.1f} %\n",
        median(touches), sorted(touches).back(), median(seconds), sorted(seconds).back(),
        median(before), median(before_max), median(after), median(max), sorted(after).back(),
        sorted(max).back(), median(ratio), sorted(ratio)[ratio.size() * 9 / 10],
        sorted(ratio).back(), median(worst), sorted(worst).back(), within, published, wrong,
        false_resolutions, median(covered), sorted(covered).front());
  }
  fmt::print("  left as it was: M3 mean median {:.3f}, worst {:.3f} mm\n", median(changed),
             sorted(changed).back());
  if (!full.empty())
    fmt::print(
        "  a full session of {} touches: M3 mean median {:.3f}, worst {:.3f} mm; within a fifth {} of {}\n",
        calib::kMostUpdateTouches, median(full), sorted(full).back(), full_within, full.size());
}

}  // namespace

int main(int argc, char** argv) {
  try {
    experiments::Trial trial;
    int arms = 20;
    std::uint64_t seed_from = 1;
    std::string gears = "spectrum", level = "L2";
    bool detail = false;
    int full = 10;
    int pairs = 8;
    cellcal::CommandLine app(
        "Re-calibration by at most 15 touches: 10 changes of one thing, 8 of two and 2 of nothing on each arm.\n"
        "Example: updates --arms 5 --detail");
    app.option("--arms", arms, "Random arms, each calibrated once");
    app.option("--level", level, "Touches of the calibration: L2 100, L3 400").one_of({"L2", "L3"});
    app.option("--gears", gears, "Truth's form").one_of({"none", "harmonics", "spectrum"});
    app.option("--gear-arcsec", trial.gear_arcsec, "rms per joint");
    app.option("--full", full, "Changes of each arm that are treated by a full session as well");
    app.option("--pairs", pairs, "Changes of two things on each arm");
    app.option("--seed", seed_from, "");
    app.option("--detail", detail, "Each change");
    if (const auto code = app.parse(argc, argv)) return *code;
    trial.gears = gears == "none"       ? Gears::kNone
                  : gears == "spectrum" ? Gears::kSpectrum
                                        : Gears::kHarmonics;
    trial.check = 10;
    if (level == "L3") {
      trial.spheres = 6;
      trial.fit = 400;
    }
    const calib::Robot robot = calib::load_robot(CELLCAL_EXPERIMENT_ROBOT);
    constexpr ChangeKind kOne[] = {ChangeKind::kTool,  ChangeKind::kTool,   ChangeKind::kTool,
                                   ChangeKind::kTool,  ChangeKind::kSphere, ChangeKind::kSphere,
                                   ChangeKind::kJoint, ChangeKind::kJoint,  ChangeKind::kJoint,
                                   ChangeKind::kGrowth};
    constexpr std::pair<ChangeKind, ChangeKind> kTwo[] = {
        {ChangeKind::kTool, ChangeKind::kJoint},
        {ChangeKind::kTool, ChangeKind::kSphere},
        {ChangeKind::kSphere, ChangeKind::kSphere},
        {ChangeKind::kJoint, ChangeKind::kJoint}};
    std::vector<Result> results;
    int done = 0;
    constexpr std::uint64_t kMostSeeds = 100000;
    for (std::uint64_t k = 0; done < arms && k < kMostSeeds; ++k) {
      const std::uint64_t seed = seed_from * kMostSeeds + k;
      const auto on = calibrated(robot, trial, seed);
      if (!on) continue;
      calib::Random random(seed + 7);
      std::vector<std::vector<Happening>> cases;
      for (const ChangeKind kind : kOne) cases.push_back({drawn(kind, random)});
      for (int i = 0; i < pairs; ++i) {
        const auto& [a, b] = kTwo[static_cast<std::size_t>(pairs * done + i) % std::size(kTwo)];
        cases.push_back({drawn(a, random), drawn(b, random)});
      }
      for (int i = 0; i < 2; ++i) cases.push_back({Happening{}});
      ++done;
      for (std::size_t i = 0; i < cases.size(); ++i) {
        results.push_back(updated(*on, cases[i], seed * 31 + i, static_cast<int>(i) < full));
        const Result& r = results.back();
        if (!detail) continue;
        fmt::print(
            "{} {:<34} {:<15} {:<26} {:5.3f} p {:.4f} two things {:6.1f}, {} set aside, foreseen {:.2f}; {} touches {:.1f} s; M3 {:.3f} "
            "-> {:.3f} -> {:.3f} mm, full {:.3f}; inside {:.1f} %\n",
            seed, r.done, r.met ? to_string(r.outcome) : "not met", r.explanation, r.probability,
            r.by_chance, r.log_odds_second, r.set_aside, r.reached, r.touches, r.seconds,
            1e3 * r.before.mean, 1e3 * r.changed.mean, 1e3 * r.after.mean, 1e3 * r.full.mean,
            100.0 * r.after.covered);
        std::fflush(stdout);
      }
    }
    fmt::print(
        "{} arms, gears {} {:.0f}\", calibrated by {} touches of {} spheres a month before\n", done,
        gears, trial.gear_arcsec, trial.fit, trial.spheres);
    const auto those = [&](const auto& of) {
      std::vector<const Result*> rows;
      for (const Result& r : results)
        if (of(r)) rows.push_back(&r);
      return rows;
    };
    const auto one = [](const Result& r) {
      return r.happenings.size() == 1 && r.happenings.front().kind != ChangeKind::kNothing;
    };
    print("one thing changed", those(one));
    for (const ChangeKind kind :
         {ChangeKind::kTool, ChangeKind::kSphere, ChangeKind::kJoint, ChangeKind::kGrowth})
      print(to_string(kind),
            those([&](const Result& r) { return one(r) && r.happenings.front().kind == kind; }));
    print("two things changed", those([](const Result& r) { return r.happenings.size() > 1; }));
    print("nothing changed",
          those([](const Result& r) { return r.happenings.front().kind == ChangeKind::kNothing; }));
    return 0;
  } catch (const std::exception& e) {
    std::fprintf(stderr, "updates: %s\n", e.what());
    return 1;
  }
}
