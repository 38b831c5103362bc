#pragma once
// What every controller declares: types, functions of numbers and texts. In KRL.

#include <string_view>

#include "sim/krl/program.h"

namespace cellcal::sim::krl {

extern const std::string_view kSystem;

/// SQRT, SIN, StrComp, INV_POS, ...
void bind_functions(Program& program);

}  // namespace cellcal::sim::krl
