#include "daemon/fleet/batch.h"

#include "calib/model/enum_table.h"

namespace cellcal::daemon::fleet {

const char* to_string(Refusal refusal) {
  using enum Refusal;
  static constexpr EnumNames<Refusal> kTable{{{kTopic, "topic"},
                                              {kSize, "size"},
                                              {kRate, "rate"},
                                              {kMessage, "message"},
                                              {kBound, "bound"},
                                              {kDatabase, "database"}}};
  return kTable[refusal];
}

Written& Written::operator+=(const Written& other) {
  facts += other.facts;
  twice += other.twice;
  refused += other.refused;
  stored.insert(stored.end(), other.stored.begin(), other.stored.end());
  return *this;
}

}  // namespace cellcal::daemon::fleet
