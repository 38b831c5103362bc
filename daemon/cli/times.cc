#include "daemon/cli/times.h"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

namespace cellcal::daemon {

namespace {

double part(double whole, std::int64_t of) {
  return of > 0 ? whole / static_cast<double>(of) : 0.0;
}

}  // namespace

std::string times_words(std::int64_t touches, std::span<const ActivityRow> rows) {
  std::vector<ActivityRow> sorted(rows.begin(), rows.end());
  std::erase_if(sorted, [](const ActivityRow& row) { return row.count == 0; });
  std::stable_sort(sorted.begin(), sorted.end(), [](const ActivityRow& a, const ActivityRow& b) {
    return a.total_s > b.total_s;
  });
  double total_s = 0.0;
  for (const ActivityRow& row : sorted) total_s += row.total_s;
  std::string text =
      fmt::format("{:<22} {:>9} {:>6} {:>8} {:>8} {:>8} {:>6}  {}\n", "time", "s/touch", "count",
                  "mean s", "worst s", "total s", "share", "depends on");
  for (const ActivityRow& row : sorted)
    text += fmt::format("{:<22} {:>9.3f} {:>6} {:>8.3f} {:>8.3f} {:>8.1f} {:>4.0f} %  {}\n",
                        row.activity, part(row.total_s, touches), row.count,
                        part(row.total_s, row.count), row.worst_s, row.total_s,
                        total_s > 0.0 ? 100.0 * row.total_s / total_s : 0.0, row.driver);
  return text + fmt::format("{:<22} {:>9.3f} {:>6} {:>8} {:>8} {:>8.1f}\n", "all",
                            part(total_s, touches), touches, "", "", total_s);
}

}  // namespace cellcal::daemon
