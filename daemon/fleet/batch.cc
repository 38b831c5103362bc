#include "daemon/fleet/batch.h"

namespace cellcal::daemon::fleet {

const char* to_string(Refusal refusal) {
  switch (refusal) {
    case Refusal::kTopic:
      return "topic";
    case Refusal::kSize:
      return "size";
    case Refusal::kRate:
      return "rate";
    case Refusal::kMessage:
      return "message";
    case Refusal::kBound:
      return "bound";
    case Refusal::kDatabase:
      return "database";
  }
  return "";
}

Written& Written::operator+=(const Written& other) {
  facts += other.facts;
  twice += other.twice;
  refused += other.refused;
  stored.insert(stored.end(), other.stored.begin(), other.stored.end());
  return *this;
}

}  // namespace cellcal::daemon::fleet
