#include "daemon/plant/messages/names.h"

#include <algorithm>
#include <vector>

namespace cellcal::daemon::plant {

namespace {

constexpr std::string_view kRoot = "cellcal";
constexpr std::string_view kFact = "fact", kPresence = "presence", kStored = "stored",
                           kProposal = "proposal";

bool is_letter(char c) {
  return ('a' <= c && c <= 'z') || ('A' <= c && c <= 'Z') || ('0' <= c && c <= '9') || c == '_' ||
         c == '-';
}

std::vector<std::string_view> levels_of(std::string_view text) {
  constexpr std::size_t kMost = 6;  // one more than any of these topics
  std::vector<std::string_view> levels;
  while (levels.size() < kMost) {
    const std::size_t end = text.find('/');
    levels.push_back(text.substr(0, end));
    if (end == std::string_view::npos) break;
    text.remove_prefix(end + 1);
  }
  return levels;
}

}  // namespace

bool is_name(std::string_view text) {
  return !text.empty() && text.size() <= kLongestName &&
         std::all_of(text.begin(), text.end(), is_letter);
}

std::string to_text(const Topic& topic) {
  std::string text = std::string(kRoot) + '/' + topic.of.plant + '/' + topic.of.cell + '/';
  switch (topic.subject) {
    case Subject::kFact:
      return text.append(kFact).append("/").append(topic.kind);
    case Subject::kPresence:
      return text.append(kPresence);
    case Subject::kStored:
      return text.append(kStored);
    case Subject::kProposal:
      return text.append(kProposal).append("/").append(topic.kind);
  }
  return text;
}

std::optional<Topic> topic_of(std::string_view text) {
  const std::vector<std::string_view> levels = levels_of(text);
  if (levels.size() < 4 || levels[0] != kRoot || !is_name(levels[1]) || !is_name(levels[2]))
    return std::nullopt;
  Topic topic;
  topic.of = {std::string(levels[1]), std::string(levels[2])};
  if (levels.size() == 5 && (levels[3] == kFact || levels[3] == kProposal) && is_name(levels[4])) {
    topic.subject = levels[3] == kFact ? Subject::kFact : Subject::kProposal;
    topic.kind = levels[4];
    return topic;
  }
  if (levels.size() != 4 || (levels[3] != kPresence && levels[3] != kStored)) return std::nullopt;
  topic.subject = levels[3] == kPresence ? Subject::kPresence : Subject::kStored;
  return topic;
}

std::string facts_of_all(std::string_view share) {
  const std::string all = "cellcal/+/+/fact/+";
  return share.empty() ? all : "$share/" + std::string(share) + '/' + all;
}

std::string presence_of_all() { return "cellcal/+/+/presence"; }

std::string proposals_to(const CellName& cell) { return to_text({cell, Subject::kProposal, "+"}); }

}  // namespace cellcal::daemon::plant
