#pragma once
// Why a sphere cannot be touched, in words for a person. Slow; asked only where a plan is refused.

#include <optional>
#include <string>

#include "calib/plan/reach/candidates.h"

namespace cellcal::calib {

/// "(0.10, 0.20, 0.97)"
std::string direction_words(const Eigen::Vector3d& normal);

/// Touches of the sphere that the joint limits allow are looked for as if nothing stood in the way;
/// then what hinders most of them: "from direction (..) the forearm (A4) comes within 12 mm of
/// obstacle table". Nothing where the limits allow none.
std::optional<std::string> hindrance(const Cell& cell, const ArmModel& arm,
                                     const Clearance& clearance, const PlanOptions& options,
                                     std::size_t target);

/// Whether the whole line of a touch is clear, from the clear point to the end of the search.
bool clear_line(const Clearance& clearance, const Candidate& candidate);

}  // namespace cellcal::calib
