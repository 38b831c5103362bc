// Share of spheres located with an inaccurately stated centre, and number of searches.

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <string>
#include <vector>

#include "calib/model/error.h"
#include "sim/cell/truth.h"
#include "tests/calib/plan/find_drive.h"
#include "tests/command_line/command_line.h"

namespace {

using namespace cellcal;
using Eigen::Vector3d;

struct Tip {
  const char* name;
  double radius_m;
};
constexpr Tip kTips[] = {{"point", 0.0}, {"6 mm ball", 0.003}};

struct Row {
  int found = 0, of = 0;
  std::vector<int> touches{}, searches{};
  double worst_off_m = 0.0, tip_m = 1.0, shaft_m = 1.0;
};

/// Relative to the sphere as seen by the nominal arm: the mean error of its tip there, base frame.
void add(Row& row, double diameter_m, double sigma_m, const Tip& tip, std::uint64_t seed,
         bool detail) {
  calib::Cell cell =
      calib::testing::table_cell(diameter_m, tip.radius_m, static_cast<std::size_t>(seed));
  sim::TruthOptions options;
  options.seed = seed;
  const sim::Truth truth = sim::draw_truth(cell, options);
  const Vector3d taught = cell.targets.front().centre_m;
  cell = calib::testing::as_rough_as_stated(cell, sigma_m, static_cast<unsigned>(seed));
  ++row.of;
  try {
    const auto found = calib::testing::drive(cell, truth, true, 1);
    row.found += found.done;
    row.touches.push_back(found.touches);
    row.searches.push_back(found.touches + found.misses);
    row.worst_off_m =
        std::max(row.worst_off_m, (found.cell.targets.front().centre_m - taught).norm());
    row.tip_m = std::min(row.tip_m, found.nearest.tip_m);
    row.shaft_m = std::min(row.shaft_m, found.nearest.shaft_m);
    if (found.began_inside) fmt::print("seed {}: a search began inside its sphere\n", seed);
  } catch (const calib::PlanError& error) {
    if (detail) fmt::print("    seed {}: {}\n", seed, error.what());
  }
}

template <class T>
T at_share(std::vector<T> values, double share) {
  if (values.empty()) return {};
  std::ranges::sort(values);
  return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
}

}  // namespace

int main(int argc, char** argv) {
  try {
    std::vector<double> diameters_mm{20.0, 30.0, 40.0, 60.0, 100.0},
        sigmas_mm{2.0, 5.0, 10.0, 20.0};
    int spheres = 40;
    std::uint64_t seed_from = 1;
    bool detail = false;
    cellcal::CommandLine app(
        "Spheres whose centres are stated roughly: found, and with how many searches.\n"
        "Example: finding --spheres 10 --diameters-mm 40 --sigmas-mm 10 20");
    app.option("--spheres", spheres, "Per row");
    app.option("--diameters-mm", diameters_mm, "");
    app.option("--sigmas-mm", sigmas_mm, "Of the stated centres, per component");
    app.option("--seed", seed_from, "The first");
    app.option("--detail", detail, "Each one that is not found");
    if (const auto code = app.parse(argc, argv)) return *code;
    fmt::print(
        "diameter  sigma        tip      found   touches      searches    off most  nearest tip, "
        "shaft\n"
        "      mm     mm                           median max  median max        mm           mm\n");
    for (const double diameter_mm : diameters_mm)
      for (const double sigma_mm : sigmas_mm)
        for (const Tip& tip : kTips) {
          Row row;
          for (int k = 0; k < spheres; ++k)
            add(row, diameter_mm * 1e-3, sigma_mm * 1e-3, tip,
                seed_from + static_cast<std::uint64_t>(k), detail);
          fmt::print(
              "{:>8.0f} {:>6.0f} {:>10}  {:>3} of {:<3}  {:>6} {:>3}  {:>6} {:>3} {:>9.1f} "
              "{:>8.1f} {:>6.1f}\n",
              diameter_mm, sigma_mm, tip.name, row.found, row.of, at_share(row.touches, 0.5),
              at_share(row.touches, 1.0), at_share(row.searches, 0.5), at_share(row.searches, 1.0),
              row.worst_off_m * 1e3, row.tip_m * 1e3, row.shaft_m * 1e3);
          std::fflush(stdout);
        }
    return 0;
  } catch (const std::exception& e) {
    std::fprintf(stderr, "finding: %s\n", e.what());
    return 1;
  }
}
