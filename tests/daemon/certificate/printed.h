#pragma once
// What a certificate's HTML shows: its entries with their origins, and its own words.

#include <string>
#include <vector>

namespace cellcal::daemon::testing {

struct Printed {
  std::string from, text;
};

/// All entries, and what is left of the document's text without them.
std::vector<Printed> entries_of(const std::string& html, std::string& rest);
/// Each occurrence of `what` by `by`.
std::string replaced(std::string text, const std::string& what, const std::string& by);

}  // namespace cellcal::daemon::testing
