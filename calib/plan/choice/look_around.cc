#include "calib/plan/choice/look_around.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "calib/model/long_work.h"
#include "calib/model/random.h"

namespace cellcal::calib {

namespace {

/// So many candidates like those picked are added, by these turns one after the other, and
/// exchanged for, until that brings too little. At 30 touches of four spheres it takes a fifth off
/// the error that is foreseen, at 50 an eighth.
constexpr double kByRad[] = {0.5, 0.35, 0.25, 0.17, 0.1, 0.05};
constexpr int kAroundEach = 60;
constexpr int kMostAround = 2000;
constexpr double kIsWorth = 0.01;  // share of the error

}  // namespace

void look_around(const Cell& cell, Pool& pool, std::size_t spread, ChooseOptions how,
                 Choice& choice) {
  Random random(how.seed + 2);
  constexpr double kRounds = std::size(kByRad);
  double round = 0.0;
  for (const double by_rad : kByRad) {
    const Part part(PlanStep::kChoose, round / kRounds, (round + 1.0) / kRounds);
    round += 1.0;
    choice.picked = pool.forget(spread, std::move(choice.picked));
    pool.vary(choice.picked, std::min(kMostAround, kAroundEach * how.count), by_rad, random);
    how.start = choice.picked;
    const double before_m = choice.reducible_m;
    choice = choose(cell, pool.candidates(), how);
    if (choice.reducible_m > (1.0 - kIsWorth) * before_m) break;
  }
}

}  // namespace cellcal::calib
