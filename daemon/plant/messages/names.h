#pragma once
// Who speaks, and under which topic.

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

/// 1 to 64 of A-Z a-z 0-9 _ -: stands in a topic, a file name, a table and a page as it is.
bool is_name(std::string_view text);

enum class Subject { kFact, kPresence, kStored, kProposal };
struct Topic {
  CellName of;
  Subject subject = Subject::kFact;
  std::string kind;  ///< of a fact, or id of a proposal, as it stands there

  bool operator==(const Topic&) const = default;
};

/// "cellcal/graz/weld-3/fact/touch"
std::string to_text(const Topic& topic);
/// None: it is none of these.
std::optional<Topic> topic_of(std::string_view text);

/// What a collector subscribes to: all cells of all plants. `share`: several collectors of that group share them.
std::string facts_of_all(std::string_view share);
std::string presence_of_all();
/// What a cell subscribes to: what is proposed to it.
std::string proposals_to(const CellName& cell);

}  // namespace cellcal::daemon::plant
