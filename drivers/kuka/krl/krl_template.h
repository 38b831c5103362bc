#pragma once
// Text templates with placeholders "@NAME@": upper-case letters, digits and underscores.

#include <map>
#include <string>
#include <string_view>

namespace cellcal::drivers::krl {

using Places = std::map<std::string, std::string, std::less<>>;

/// The template of that name, as in krl/. Throws std::logic_error if there is none.
std::string_view template_text(std::string_view name);

/// Filled in, with CRLF line endings. A line that consists of one placeholder with an empty value
/// is removed. Throws std::logic_error for an unfilled placeholder: a defect, not a configuration
/// error.
std::string fill(std::string_view text, const Places& places);

/// A REAL with a decimal point, unrounded: a limit rounded down would clamp before the adapter does.
std::string decimal(double value);

/// Version number of this release.
std::string release();

}  // namespace cellcal::drivers::krl
