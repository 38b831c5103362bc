#pragma once
// Refusals of the modules of a program or backup.

#include <map>
#include <string>
#include <vector>

#include "daemon/krl/krl_program.h"

namespace cellcal::daemon::krl {

/// By file and line.
void sort_by_place(std::vector<Refusal>& refusals);
/// Refusals of each module: unreadable statements, and the refused points of its motions. `of_points`: by the key of
/// the point.
std::vector<std::vector<Refusal>> refusals_of_modules(
    const Program& program, std::multimap<std::string, Refusal> of_points);
/// A point of a refused module stays unchanged, and with it all modules that move to it.
void refuse_shared(const Program& program, std::vector<std::vector<Refusal>>& refusals);

}  // namespace cellcal::daemon::krl
