// Diagrams of the transition table.

#include <map>

#include "daemon/session/session.h"

namespace cellcal::daemon {

namespace {

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
