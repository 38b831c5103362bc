#include <sstream>

#include "daemon/fleet/api/answers.h"

namespace cellcal::daemon::fleet {

namespace {

class Lines {
 public:
  void family(const char* name, const char* type, const char* help) {
    out_ << "# HELP " << name << ' ' << help << "\n# TYPE " << name << ' ' << type << '\n';
  }
  void one(const char* name, const char* type, const char* help, std::uint64_t value) {
    family(name, type, help);
    out_ << name << ' ' << value << '\n';
  }
  /// `value` is a name: letters and hyphens.
  void labelled(const char* name, const char* label, const std::string& value,
                std::uint64_t count) {
    out_ << name << '{' << label << "=\"" << value << "\"} " << count << '\n';
  }
  std::string text() const { return out_.str(); }

 private:
  std::ostringstream out_;
};

void add_collector(Lines& lines, const Counters& counters) {
  lines.one("cellcal_fleet_messages_total", "counter", "Messages stored or refused.",
            counters.messages);
  lines.one("cellcal_fleet_facts_total", "counter", "Facts stored.", counters.facts);
  lines.one("cellcal_fleet_twice_total", "counter", "Facts that were there already.",
            counters.twice);
  lines.one("cellcal_fleet_refused_total", "counter",
            "Messages refused: quarantined, or above a cell's rate and only counted.",
            counters.refused);
  lines.one("cellcal_fleet_batches_total", "counter", "Transactions.", counters.batches);
  lines.one("cellcal_fleet_broker_up", "gauge", "1: connected to the broker.",
            counters.broker_up ? 1 : 0);
  lines.one("cellcal_fleet_database_up", "gauge", "1: connected to the database.",
            counters.store_up ? 1 : 0);
  lines.one("cellcal_fleet_broker_lost_total", "counter", "Connections to the broker that broke.",
            counters.broker_lost);
  lines.one("cellcal_fleet_database_lost_total", "counter",
            "Connections to the database that broke.", counters.store_lost);
}

void add_plant(Lines& lines, const Totals& totals) {
  const auto count = [](std::int64_t value) { return static_cast<std::uint64_t>(value); };
  lines.one("cellcal_fleet_cells", "gauge", "Cells that are known.", count(totals.cells));
  lines.one("cellcal_fleet_cells_online", "gauge", "Cells that are online.", count(totals.online));
  lines.one("cellcal_fleet_gaps", "gauge", "Ranges of numbers that did not come.",
            count(totals.gaps));
  lines.one("cellcal_fleet_quarantined", "gauge", "Messages that ever were refused.",
            count(totals.refused));
  constexpr const char* kNeeds = "cellcal_fleet_cells_in_need";
  lines.family(kNeeds, "gauge", "Cells by what they need attention for.");
  for (const auto& [what, cells] : totals.needs) lines.labelled(kNeeds, "what", what, count(cells));
}

}  // namespace

std::string fleet_metrics(Reading& reading, const Counters& counters) {
  Lines lines;
  add_collector(lines, counters);
  try {
    add_plant(lines, reading.totals());
  } catch (const StoreAway&) {
    // cellcal_fleet_database_up says it
  }
  return lines.text();
}

}  // namespace cellcal::daemon::fleet
