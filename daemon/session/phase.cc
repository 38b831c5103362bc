#include "daemon/session/phase.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "daemon/session/session.h"

namespace cellcal::daemon {

namespace {

/// Phases of one activity that follow each other.
class Stay {
 public:
  void go_on(PhaseTimes& times, Activity activity, double took_s) {
    ActivityTime& time = times.of[static_cast<std::size_t>(activity)];
    if (!began_ || activity != activity_) {
      *this = {};
      ++time.count;
    }
    began_ = true;
    activity_ = activity;
    so_far_s_ += took_s;
    time.total_s += took_s;
    time.worst_s = std::max(time.worst_s, so_far_s_);
    times.total_s += took_s;
  }

 private:
  bool began_ = false;
  Activity activity_ = Activity::kOther;
  double so_far_s_ = 0.0;
};

bool under_way(Phase phase) { return phase != Phase::kIdle && !is_final(phase); }

std::string identifier(Phase phase) {
  std::string name = to_string(phase);
  for (char& c : name) {
    if (c == ' ') c = '_';
  }
  return name;
}

std::string events_of(const Transition& row) {
  std::string names;
  for (EventKind kind : kAllEvents) {
    if (!row.on.has(kind)) continue;
    if (!names.empty()) names += ", ";
    names += to_string(kind);
  }
  return names;
}

std::string label(const Transition& row) {
  std::string text = events_of(row);
  if (row.when_words[0] != '\0') text += std::string(" [") + row.when_words + "]";
  return text;
}

/// Omits failing, stopping and aborting, which most phases share and which would obscure the regular
/// sequence.
bool is_way_through(const Transition& row) {
  if (!row.to) return false;
  return *row.to != Phase::kFailed && *row.to != Phase::kAborted && *row.to != Phase::kStopping;
}

struct Edge {
  Phase from, to;
  bool operator<(const Edge& other) const {
    return from != other.from ? from < other.from : to < other.to;
  }
};

/// All labels of one edge, in the table's order.
std::map<Edge, std::vector<std::string>> way_through() {
  std::map<Edge, std::vector<std::string>> edges;
  for (const Transition& row : transition_table()) {
    if (!is_way_through(row)) continue;
    for (Phase from : kAllPhases) {
      if (row.from.has(from)) edges[{from, *row.to}].push_back(label(row));
    }
  }
  return edges;
}

std::string join(const std::vector<std::string>& labels, const char* separator) {
  std::string text;
  for (const std::string& one : labels) text += (text.empty() ? "" : separator) + one;
  return text;
}

}  // namespace

const char* to_string(Activity activity) {
  using enum Activity;
  static constexpr EnumNames<Activity> kTable{{{kMoving, "transit and retreat"},
                                               {kFastSearch, "fast search"},
                                               {kConfirming, "back-off, slow search"},
                                               {kArming, "arming"},
                                               {kRecording, "recording"},
                                               {kChoosing, "choosing"},
                                               {kProving, "proving"},
                                               {kOther, "other"}}};
  return kTable[activity];
}

const char* driver_of(Activity activity) {
  using enum Activity;
  static constexpr EnumNames<Activity> kTable{{{kMoving, "axis limits"},
                                               {kFastSearch, "search speed, approach"},
                                               {kConfirming, "confirmations"},
                                               {kArming, "serial line"},
                                               {kRecording, "disk"},
                                               {kChoosing, "processor"},
                                               {kProving, "self-test"},
                                               {kOther, "links, plan, estimate"}}};
  return kTable[activity];
}

Activity activity_of(Phase phase) {
  switch (phase) {
    case Phase::kFreeing:
    case Phase::kTransit:
    case Phase::kRetreat:
    case Phase::kReturning: return Activity::kMoving;
    case Phase::kFastSearch: return Activity::kFastSearch;
    case Phase::kBackingOff:
    case Phase::kSlowSearch: return Activity::kConfirming;
    case Phase::kArmingFast:
    case Phase::kArmingSlow: return Activity::kArming;
    case Phase::kRecording: return Activity::kRecording;
    case Phase::kChoosing: return Activity::kChoosing;
    case Phase::kProving: return Activity::kProving;
    default: return Activity::kOther;
  }
}

PhaseTimes phase_times(std::span<const TimedChange> changes) {
  PhaseTimes times;
  const TimedChange* last = nullptr;
  Stay stay;
  for (const TimedChange& now : changes) {
    if (!std::isfinite(now.clock_s)) continue;
    const Phase phase = now.change.from;
    if (last != nullptr && under_way(phase) && last->change.to == phase) {
      stay.go_on(times, activity_of(phase),
                 std::max(0.0, now.clock_s - last->clock_s));  // another daemon's clock
      // From the watch it goes back to the same wait.
      times.interruptions +=
          now.change.to == Phase::kRecovering && phase != Phase::kWatchingTheLinks ? 1 : 0;
      times.touches += phase == Phase::kRecording && !is_final(now.change.to) ? 1 : 0;
    } else {
      stay = {};
    }
    last = &now;
  }
  return times;
}

std::string mermaid_picture() {
  std::string text = "stateDiagram-v2\n  [*] --> idle\n";
  for (const auto& [edge, labels] : way_through()) {
    text += "  " + identifier(edge.from) + " --> " + identifier(edge.to) + " : " +
            join(labels, " / ") + "\n";
  }
  return text + "  done --> [*]\n";
}

std::string graphviz_picture() {
  std::string text = "digraph session {\n  rankdir=TB;\n  node [shape=box, style=rounded];\n";
  for (const Transition& row : transition_table()) {
    if (!row.to) continue;
    for (Phase from : kAllPhases) {
      if (!row.from.has(from)) continue;
      text += "  " + identifier(from) + " -> " + identifier(*row.to) + " [label=\"" + label(row) +
              "\", tooltip=\"" + row.words + "\"" +
              (is_way_through(row) ? "" : ", style=dashed, color=gray") + "];\n";
    }
  }
  return text + "}\n";
}

}  // namespace cellcal::daemon
