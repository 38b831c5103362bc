#pragma once
// What is written together, and what it was refused for.

#include <map>
#include <string>
#include <vector>

#include "daemon/plant/messages/fact.h"
#include "daemon/plant/messages/presence.h"

namespace cellcal::daemon::fleet {

enum class Refusal {
  kTopic,    ///< none of ours
  kSize,     ///< too large to be read
  kRate,     ///< its cell sends more than it may
  kMessage,  ///< damaged, of an unknown kind, or another cell's
  kBound,    ///< more cells than a plant has, more journals or more scattered numbers than a cell
  kDatabase  ///< PostgreSQL does not take it
};
const char* to_string(Refusal refusal);

struct Refused {
  plant::CellName of;  ///< by its topic; empty: none
  std::string topic, payload;
  Refusal why = Refusal::kMessage;
  std::string words;
};

struct Batch {
  std::vector<plant::Fact> facts;
  std::vector<plant::Presence> presences;
  std::vector<Refused> refused;
  /// Refused for Refusal::kRate: counted, and not kept.
  std::map<plant::CellName, std::size_t> too_many;

  bool empty() const {
    return facts.empty() && presences.empty() && refused.empty() && too_many.empty();
  }
};

struct Written {
  std::size_t facts = 0;    ///< that are new
  std::size_t twice = 0;    ///< that were there already
  std::size_t refused = 0;  ///< of the batch, and by the database
  /// Of each journal of which the batch had results, new or not: what is stored of it, once this is committed.
  std::vector<plant::Stored> stored = {};

  Written& operator+=(const Written& other);
};

}  // namespace cellcal::daemon::fleet
