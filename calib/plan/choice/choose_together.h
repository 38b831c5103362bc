#pragma once
// Which touches together take most from what an estimate leaves unknown.

#include <cstddef>
#include <functional>
#include <vector>

#include "calib/plan/choice/design.h"

namespace cellcal::calib {

/// `count` candidates of the design, one after the other by (67) and then exchanged for better ones;
/// fewer where no more are possible. `possible`: asked of a candidate only before it is picked, and
/// not again where it said no.
std::vector<std::size_t> choose_together(Design design, int count,
                                         const std::function<bool(std::size_t)>& possible);

}  // namespace cellcal::calib
