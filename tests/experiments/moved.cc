// Share of moved spheres that are detected, and of unmoved ones that are accused.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "calib/files/files.h"
#include "calib/files/robot_file.h"
#include "calib/identify/identify.h"
#include "calib/model/linear.h"
#include "tests/command_line/command_line.h"
#include "tests/experiments/world.h"

namespace {

using namespace cellcal;
using experiments::Gears;

constexpr std::uint64_t kMostSeeds = 100000;

struct Settings {
  experiments::Stage stage;
  int fit = 100, check = 10;
  bool mixed = false;  ///< spheres mixed; otherwise in the order of the plan's route
};

/// A cell and its planned touches.
struct Planned {
  calib::Cell cell;
  calib::Plan plan;
  calib::Random random;
};

/// Empty if no plan is possible for the cell.
std::optional<Planned> plan_session(const calib::Robot& robot, const Settings& settings,
                                    std::uint64_t seed) {
  calib::Random random(seed);
  const calib::Cell cell = experiments::make_cell(robot, settings.stage, random);
  calib::PlanOptions options;
  options.fit_touches = settings.fit;
  options.check_touches = settings.check;
  options.seed = static_cast<unsigned>(seed);
  try {
    return Planned{cell, calib::make_plan(cell, options), random};
  } catch (const calib::PlanError&) {
    return std::nullopt;  // another cell is drawn
  }
}

struct Move {
  std::size_t sphere;
  double when;  ///< share of that sphere's fit touches made before
  Eigen::Vector3d shift_m;
};

/// Arms differ for different gears, and are the same for the same ones.
std::pair<calib::Cell, std::vector<calib::Touch>> carry_out(Planned planned,
                                                            const experiments::Stage& stage,
                                                            bool mixed, const Move& move) {
  auto& [cell, plan, random] = planned;
  const experiments::World world(cell, stage, random);
  for (std::size_t i = plan.touches.size(); mixed && i > 1; --i)
    std::swap(plan.touches[i - 1], plan.touches[random.below(i)]);
  const auto of_it = [&](const calib::PlannedTouch& p) {
    return cell.target_index(p.target) == move.sphere && p.set == calib::TouchSet::kFit;
  };
  const auto all = std::count_if(plan.touches.begin(), plan.touches.end(), of_it);
  std::vector<calib::Touch> touches;
  double made = 0.0;
  for (std::size_t i = 0; i < plan.touches.size(); ++i) {
    const calib::PlannedTouch& p = plan.touches[i];
    const bool gone =
        cell.target_index(p.target) == move.sphere && made >= move.when * static_cast<double>(all);
    made += of_it(p);
    const double warm = static_cast<double>(i) / static_cast<double>(plan.touches.size());
    if (auto t = world.touch(p, warm, experiments::kBeyond, random,
                             gone ? move.shift_m : Eigen::Vector3d::Zero()))
      touches.push_back(std::move(*t));
  }
  return {world.cell, touches};
}

struct Row {
  double moved_m = 0.0, gear_arcsec = 0.0;
  int made = 0, named = 0, accused = 0, withheld = 0, published = 0, measured = 0;
  double off = 0.0, sigma = 0.0;
};

Eigen::Vector3d any_direction(calib::Random& random) {
  const Eigen::Vector3d d(random.normal(), random.normal(), random.normal());
  return d.normalized();
}

/// One session in which a random sphere is moved by this much in the middle half of its touches.
void add_session(Row& row, const Planned& planned, Settings settings, std::uint64_t seed,
                 bool detail) {
  calib::Random random(seed + 7);
  settings.stage.truth.gear_arcsec = row.gear_arcsec;
  const std::size_t sphere = random.below(static_cast<std::size_t>(settings.stage.spheres));
  const double when = random.uniform(0.25, 0.75);
  const Move move{sphere, when, row.moved_m * any_direction(random)};
  const auto [cell, touches] = carry_out(planned, settings.stage, settings.mixed, move);
  const calib::Calibration c = calib::identify(cell, touches, {}, calib::shipped_robots);
  const std::string id = row.moved_m > 0.0 ? cell.targets[sphere].id : "none";
  bool says = false;
  for (const calib::Finding& one : c.verdict.findings) {
    says = says || (one.kind == calib::FindingKind::kMovedTarget && one.about.name == id);
    says = says || (one.cause == calib::LikelyCause::kMoved && one.about.name == id);
  }
  ++row.made;
  row.published += c.verdict.publish();
  row.named += says;
  const calib::MovedTarget* moved = c.moved.empty() ? nullptr : &c.moved.front();
  row.accused += moved != nullptr && moved->target != id;
  row.withheld += !c.verdict.publish() && moved == nullptr && !says;
  if (moved != nullptr && moved->target == id) {
    ++row.measured;
    row.off += (moved->shift_m - move.shift_m).norm();
    row.sigma += moved->sigma_m;
  }
  if (detail && moved != nullptr)
    fmt::print(
        "    {}, {:.0f} arcsec: {} moved {:.3f} +- {:.3f} mm, {:.0f} squared sigmas; "
        "true: {} {:.2f} mm\n",
        seed, row.gear_arcsec, moved->target, moved->shift_m.norm() * 1e3, moved->sigma_m * 1e3,
        moved->squared_sigmas, id, row.moved_m * 1e3);
}

void print(const Row& row) {
  fmt::print("{:>8.2f} {:>8.0f} {:>9} {:>7} {:>8} {:>9} {:>10}", row.moved_m * 1e3, row.gear_arcsec,
             row.made, row.named, row.accused, row.withheld, row.published);
  if (row.measured > 0)
    fmt::print("   off {:.3f} mm, said +- {:.3f} mm", row.off / row.measured * 1e3,
               row.sigma / row.measured * 1e3);
  fmt::print("\n");
}

}  // namespace

int main(int argc, char** argv) {
  try {
    Settings settings;
    int sessions = 100;
    bool detail = false;
    std::uint64_t seed_from = 1;
    std::string gears = "spectrum", order = "route", arm = CELLCAL_EXPERIMENT_ROBOT;
    std::vector<double> moved_mm{0.0, 0.1, 0.2, 0.5}, arcsec{10.0, 20.0};
    cellcal::CommandLine app(
        "Spheres that move during a session: found, and accused wrongly.\n"
        "Example: moved --sessions 200 --moved-mm 0 0.15");
    app.option("--sessions", sessions, "Per row");
    app.option("--moved-mm", moved_mm, "By how much");
    app.option("--gears", gears, "Truth's form").one_of({"none", "harmonics", "spectrum"});
    app.option("--gear-arcsec", arcsec, "rms per joint");
    app.option("--order", order, "Of the touches: sphere by sphere along the route, or mixed")
        .one_of({"route", "mixed"});
    app.option("--fit", settings.fit, "Touches");
    app.option("--growth", settings.stage.truth.growth, "Of all lengths over the session");
    app.option("--outliers", settings.stage.outlier_share, "Share");
    app.option("--seed", seed_from, "");
    app.option("--detail", detail, "Each one found");
    if (const auto code = app.parse(argc, argv)) return *code;
    settings.stage.truth.gears = gears == "none"       ? Gears::kNone
                                 : gears == "spectrum" ? Gears::kSpectrum
                                                       : Gears::kHarmonics;
    settings.mixed = order == "mixed";
    const calib::Robot robot = calib::load_robot(arm);
    std::vector<Row> rows;
    for (const double seconds : arcsec)
      for (const double mm : moved_mm) {
        rows.emplace_back();
        rows.back().moved_m = mm * 1e-3;
        rows.back().gear_arcsec = seconds;
      }
    int made = 0;
    for (std::uint64_t k = 0; made < sessions && k < kMostSeeds; ++k) {
      const std::uint64_t seed = seed_from * kMostSeeds + k;
      const auto planned = plan_session(robot, settings, seed);
      if (!planned) continue;
      ++made;
      for (Row& row : rows) add_session(row, *planned, settings, seed, detail);
    }
    fmt::print(
        "moved mm   arcsec  sessions   named  accused  withheld  published\n"
        "                                      wrongly otherwise\n");
    for (const Row& row : rows) print(row);
    return 0;
  } catch (const std::exception& e) {
    std::fprintf(stderr, "moved: %s\n", e.what());
    return 1;
  }
}
