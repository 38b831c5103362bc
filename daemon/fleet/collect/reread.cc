#include "daemon/fleet/collect/reread.h"

#include <fmt/format.h>

#include "daemon/fleet/collect/judge.h"

namespace cellcal::daemon::fleet {

namespace {

/// It was paid for when it came.
constexpr Allowance kAll{.messages_per_s = 1.0, .burst = 1e18, .bytes_per_day = 1e18};

/// False: refused.
bool take(Store& store, const Kept& kept, Meters& meters, Reread& result) {
  Batch batch;
  judge({kept.topic, kept.payload}, meters, {}, batch);
  if (!batch.refused.empty() || batch.empty()) return false;
  const Written written = store.write(batch);
  if (written.refused > 0) return false;
  result.stored += written.facts + batch.presences.size();
  result.twice += written.twice;
  return true;
}

}  // namespace

Reread reread_quarantine(Store& store) {
  Reread result;
  Meters meters(kAll);
  std::int64_t last = 0;
  for (std::vector<Kept> few = store.kept(last); !few.empty(); few = store.kept(last)) {
    for (const Kept& kept : few) {
      last = kept.id;
      if (!kept.whole)
        result.cut.push_back(fmt::format("{}, {} bytes", kept.topic, kept.bytes));
      else if (take(store, kept, meters, result))
        store.let_go(kept.id);
      else
        ++result.refused;
    }
  }
  return result;
}

}  // namespace cellcal::daemon::fleet
