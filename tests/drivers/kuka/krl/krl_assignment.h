#pragma once
// Definite assignment in KRL: a local variable has a value on every path to where it is read or
// passed on. KRL does not initialise locals, and stops with KSS01422 if one has no value.

#include <string>
#include <string_view>
#include <vector>

namespace cellcal::drivers::krl {

/// Errors for locals of DEF and DEFFCT without a value, each with its line; empty: none. Variables
/// filled by EKI_Get...() count as read: KUKA's manual requires a value beforehand.
std::vector<std::string> check_assignments(std::string_view text);

}  // namespace cellcal::drivers::krl
