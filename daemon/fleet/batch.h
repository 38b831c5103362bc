#pragma once
// Batch of messages that is written in one transaction, and reasons for refusal.

#include <map>
#include <string>
#include <vector>

#include "daemon/plant/messages/fact.h"
#include "daemon/plant/messages/presence.h"

namespace cellcal::daemon::fleet {

enum class Refusal {
  kTopic,    ///< not a topic of cellcal
  kSize,     ///< too large to read
  kRate,     ///< its cell exceeds its rate
  kMessage,  ///< damaged, of an unknown kind, or another cell's
  kBound,    ///< more cells than a plant has, more journals or scattered numbers than a cell
  kDatabase  ///< rejected by PostgreSQL
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
  /// Counts of messages refused with Refusal::kRate, which are not kept.
  std::map<plant::CellName, std::size_t> too_many;

  bool empty() const {
    return facts.empty() && presences.empty() && refused.empty() && too_many.empty();
  }
};

struct Written {
  std::size_t facts = 0;    ///< new ones
  std::size_t twice = 0;    ///< stored before
  std::size_t refused = 0;  ///< of the batch, and by the database
  /// Stored results of each journal of the batch with results, new or not, once this is committed.
  std::vector<plant::Stored> stored = {};

  Written& operator+=(const Written& other);
};

}  // namespace cellcal::daemon::fleet
