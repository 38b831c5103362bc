#pragma once
// Definite assignment in KRL: a local variable has a value on every path to where it is read, or
// passed on. KRL gives locals none of its own, and stops with KSS01422 where one is missing.

#include <string>
#include <string_view>
#include <vector>

namespace cellcal::drivers::krl {

/// Complaints about locals of DEF and DEFFCT without a value, each with its line; empty: none. What
/// EKI_Get...() fills counts as read: KUKA's manual asks for a value beforehand.
std::vector<std::string> check_assignments(std::string_view text);

}  // namespace cellcal::drivers::krl
