#pragma once
// Declarations of every controller, in KRL: types, numeric and text functions.

#include <string_view>

#include "sim/krl/program.h"

namespace cellcal::sim::krl {

extern const std::string_view kSystem;

/// SQRT, SIN, StrComp, INV_POS, ...
void bind_functions(Program& program);

}  // namespace cellcal::sim::krl
