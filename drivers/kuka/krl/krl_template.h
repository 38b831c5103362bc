#pragma once
// Text with places to fill in: "@NAME@", capital letters, digits and underscores.

#include <map>
#include <string>
#include <string_view>

namespace cellcal::drivers::krl {

using Places = std::map<std::string, std::string, std::less<>>;

/// The template of that name, as it lies in krl/. Throws std::logic_error where there is none.
std::string_view template_text(std::string_view name);

/// Filled in, lines ended by CRLF. A line that holds nothing but a place which is filled with
/// nothing disappears. Throws std::logic_error where a place is left over: a defect, not a
/// configuration.
std::string fill(std::string_view text, const Places& places);

/// A REAL with a decimal point, unrounded: a limit rounded down would clamp before the adapter does.
std::string decimal(double value);

/// The number of this release.
std::string release();

}  // namespace cellcal::drivers::krl
