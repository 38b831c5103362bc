#include "daemon/plant/messages/presence.h"

#include <algorithm>

namespace cellcal::daemon::plant {

namespace {

namespace fields = calib::fields;
using fields::field, fields::Json;

constexpr const char* kPresenceFormat = "cellcal.presence/1";
constexpr const char* kStoredFormat = "cellcal.stored/1";
constexpr const char* kProposalFormat = "cellcal.proposal/1";
constexpr std::size_t kLargestPresence = std::size_t{1} << 14;
constexpr std::size_t kLargestStored = std::size_t{1} << 16;
constexpr std::size_t kLargestProposal = std::size_t{1} << 18;

/// With the head that all messages have.
template <class T>
Json written(const char* format, const fields::Table<T>& table, const T& message) {
  Json json{{"format", format}, {"plant", message.of.plant}, {"cell", message.of.cell}};
  json.update(fields::to_json(table, message));
  return json;
}

template <class T>
T read(const nlohmann::json& json, const char* format, const fields::Table<T>& table,
       const Topic& topic) {
  const calib::JsonReader reader(json, to_text(topic));
  T message;
  message.of = sender(reader, format, topic);
  fields::from_json(table, reader, message);
  return message;
}

const fields::Table<Presence> kPresenceFields{
    field("online", &Presence::online, fields::flag()),
    field("farewell", &Presence::farewell, fields::flag()),
    field("journal", &Presence::journal, name()),
    field("number", &Presence::number, count<std::int64_t>()),
    field("software", &Presence::software, line()),
    field("time", &Presence::time, line()),
    field("mock", &Presence::mock, fields::flag())};

std::pair<std::int64_t, std::int64_t> range_of(const calib::JsonReader& reader) {
  const auto ends = reader.items();
  if (ends.size() != 2) reader.fail("must hold two numbers");
  const auto number = count<std::int64_t>();
  const std::pair range{number.from(ends[0]), number.from(ends[1])};
  if (range.first < 1 || range.second < range.first) reader.fail("must go from 1 or more upwards");
  return range;
}

fields::Value<std::vector<std::pair<std::int64_t, std::int64_t>>> ranges() {
  return {[](const auto& ranges) {
            Json list = Json::array();
            for (const auto& [from, to] : ranges) list.push_back({from, to});
            return list;
          },
          [](const calib::JsonReader& reader) {
            const auto items = reader.items();
            if (items.size() > kMostStoredRanges) reader.fail("has too many ranges");
            std::vector<std::pair<std::int64_t, std::int64_t>> ranges;
            for (const calib::JsonReader& one : items) ranges.push_back(range_of(one));
            return ranges;
          }};
}

const fields::Table<Stored> kStoredFields{field("journal", &Stored::journal, name()),
                                          field("numbers", &Stored::numbers, ranges())};

const fields::Table<Proposal> kProposalFields{
    field("id", &Proposal::id, name()),
    field("kind", &Proposal::kind, fields::named<ProposalKind>()),
    field("session", &Proposal::session, count<std::int64_t>()),
    field("text", &Proposal::text, bounded(kLongestText)),
    field("by", &Proposal::by, line()),
    field("reason", &Proposal::reason, bounded(kLongestText)),
    field("time", &Proposal::time, line())};

}  // namespace

std::string to_json(const Presence& presence) {
  return text_of(written(kPresenceFormat, kPresenceFields, presence));
}

Presence presence_from_json(std::string_view json, const Topic& topic) {
  return read(json_of(json, kLargestPresence, to_text(topic)), kPresenceFormat, kPresenceFields,
              topic);
}

bool Stored::has(std::int64_t number) const {
  return std::any_of(numbers.begin(), numbers.end(), [&](const auto& range) {
    return range.first <= number && number <= range.second;
  });
}

std::string to_json(const Stored& stored) {
  return text_of(written(kStoredFormat, kStoredFields, stored));
}

Stored stored_from_json(std::string_view json, const Topic& topic) {
  return read(json_of(json, kLargestStored, to_text(topic)), kStoredFormat, kStoredFields, topic);
}

Json message_of(const Proposal& proposal) {
  return written(kProposalFormat, kProposalFields, proposal);
}

std::string to_json(const Proposal& proposal) { return text_of(message_of(proposal)); }

Proposal proposal_from_json(std::string_view json, const Topic& topic) {
  return proposal_in(json_of(json, kLargestProposal, to_text(topic)), topic);
}

Proposal proposal_in(const nlohmann::json& message, const Topic& topic) {
  const Proposal proposal = read(message, kProposalFormat, kProposalFields, topic);
  if (proposal.id != topic.kind)
    calib::JsonReader(message, to_text(topic)).at("id").fail("differs from the topic");
  return proposal;
}

}  // namespace cellcal::daemon::plant
