#pragma once
// Names of cells, and their topics.

#include <optional>
#include <string>
#include <string_view>

namespace cellcal::daemon::plant {

inline constexpr std::size_t kLongestName = 64;

/// A cell of a plant.
struct CellName {
  std::string plant, cell;

  auto operator<=>(const CellName&) const = default;
};

/// 1 to 64 of A-Z a-z 0-9 _ -: safe in topics, file names, database tables and pages.
bool is_name(std::string_view text);

enum class Subject { kFact, kPresence, kStored, kProposal };
struct Topic {
  CellName of;
  Subject subject = Subject::kFact;
  std::string kind;  ///< kind of a fact, or id of a proposal, as in the topic

  bool operator==(const Topic&) const = default;
};

/// "cellcal/graz/weld-3/fact/touch"
std::string to_text(const Topic& topic);
/// None: another topic.
std::optional<Topic> topic_of(std::string_view text);

/// Subscription of a collector: all cells of all plants. `share`: group of collectors that share the
/// messages.
std::string facts_of_all(std::string_view share);
std::string presence_of_all();
/// Subscription of a cell: proposals to it.
std::string proposals_to(const CellName& cell);

}  // namespace cellcal::daemon::plant
