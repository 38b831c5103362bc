#pragma once
// Rendering of entries in the certificate's HTML.

#include <string>
#include <string_view>
#include <vector>

#include "daemon/certificate/sources.h"

namespace cellcal::daemon::certificate {

/// The entry with its origin, numbers with the document's decimal mark; `otherwise`, an id of the catalogue or a sign,
/// where it is not stated.
std::string shown(const Entry& entry, const char* otherwise = "say.report.not_stated");
/// The number followed by its unit.
std::string with_unit(const Entry& entry, const char* otherwise = "\xE2\x80\x93");
/// The unit only, as "unit(origin)".
std::string unit(const Entry& entry);
/// A constant of the method (README, Origins).
std::string constant(const char* name);
/// Printed value of the constant.
std::string_view value_of_constant(std::string_view name);

/// The style sheet, without the <style> tags.
const char* style_sheet();

}  // namespace cellcal::daemon::certificate
