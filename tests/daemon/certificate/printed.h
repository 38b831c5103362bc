#pragma once
// Content of a certificate's HTML: its entries with their origins, and its fixed text.

#include <string>
#include <vector>

namespace cellcal::daemon::testing {

struct Printed {
  std::string from, text;
};

/// All entries; `rest` is the document's text without them.
std::vector<Printed> entries_of(const std::string& html, std::string& rest);
/// `text` with each occurrence of `what` replaced by `by`.
std::string replaced(std::string text, const std::string& what, const std::string& by);

}  // namespace cellcal::daemon::testing
