// Any bytes on any topic: the first line is the topic, the rest the message. A fact, presence or proposal that is
// read back equal after writing, or refused with a reason. Also replayed over plant_corpus as an ordinary test.

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <optional>
#include <string_view>

#include "calib/files/text.h"
#include "calib/model/error.h"
#include "daemon/fleet/judge.h"
#include "daemon/plant/desk/desk.h"
#include "daemon/plant/line/edge_node.h"
#include "daemon/plant/messages/fact.h"
#include "daemon/plant/messages/presence.h"

namespace {

using namespace cellcal::daemon;  // NOLINT: a fuzz target's own file

/// Topic, key path, text.
constexpr std::size_t kLongestReason = 2000;

void require(bool condition, const char* what) {
  if (condition) return;
  std::fprintf(stderr, "broken promise: %s\n", what);
  std::abort();
}

plant::Topic topic_for(const plant::Fact& fact) {
  return {fact.of, plant::Subject::kFact, plant::kind_of(fact.body)};
}

void as_proposal(std::string_view text, const plant::Topic& topic) {
  try {
    const plant::Proposal read = plant::proposal_from_json(text, topic);
    require(plant::proposal_from_json(plant::to_json(read), topic) == read,
            "a proposal that was read can be written and read");
  } catch (const cellcal::calib::FileError&) {
  }
}

template <class Read>
auto read_as(Read read, std::string_view text) -> std::optional<decltype(read(text))> try {
  return read(text);
} catch (const cellcal::calib::FileError&) {
  return std::nullopt;
}

/// Messages between the cell's daemon and the plant process.
void as_desk(std::string_view text) {
  (void)read_as(plant::lines_from_json, text);
  (void)read_as(plant::count_from_json, text);
  if (const auto orders = read_as(plant::orders_from_json, text))
    require(
        plant::to_json(plant::orders_from_json(plant::to_json(*orders))) == plant::to_json(*orders),
        "orders that were read can be written and read");
  if (const auto facts = read_as(plant::facts_from_lines, text))
    require(plant::to_lines(plant::facts_from_lines(plant::to_lines(*facts))) ==
                plant::to_lines(*facts),
            "facts that were read can be written and read");
  if (const auto rows = read_as(plant::rows_from_json, text))
    require(plant::rows_from_json(plant::rows_to_json(*rows)) == *rows,
            "rows that were read can be written and read");
}

void as_message(std::string_view topic, std::string_view payload) {
  fleet::Meters meters({});
  fleet::Batch batch;
  fleet::judge({std::string(topic), std::string(payload)}, meters, {}, batch);
  require(batch.facts.size() + batch.presences.size() + batch.refused.size() == 1,
          "a message is one thing");
  for (const plant::Fact& fact : batch.facts) {
    // A value in another unit may change in its last bit on the first conversion only.
    const plant::Fact once = plant::fact_from_json(plant::to_json(fact), topic_for(fact));
    require(once.number == fact.number && once.journal == fact.journal && once.of == fact.of,
            "a fact keeps its name");
    require(once.body.index() == fact.body.index(), "a fact keeps its kind");
    require(fleet::is_time(fact.time), "a fact has a time");
  }
  for (const plant::Presence& one : batch.presences)
    require(plant::presence_from_json(plant::to_json(one),
                                      {one.of, plant::Subject::kPresence, ""}) == one,
            "a presence that was read can be written and read");
  for (const fleet::Refused& one : batch.refused) {
    require(!one.words.empty(), "a refusal has its reason");
    require(one.words.size() <= kLongestReason, "a reason is short, whatever was sent");
    require(!cellcal::calib::has_control(one.words), "a reason is one line");
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view all(reinterpret_cast<const char*>(data), size);
  const std::size_t end = all.find('\n');
  const std::string_view topic = all.substr(0, end);
  const std::string_view payload =
      end == std::string_view::npos ? std::string_view() : all.substr(end + 1);
  as_message(topic, payload);
  (void)plant::sparkplug::asks_for_rebirth(payload);
  as_desk(payload);
  if (const auto known = plant::topic_of(topic)) as_proposal(payload, *known);
  return 0;
}
