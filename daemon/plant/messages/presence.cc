#include "daemon/plant/messages/presence.h"

#include <algorithm>

namespace cellcal::daemon::plant {

namespace {

namespace fields = calib::fields;
using fields::field;

constexpr const char* kPresenceFormat = "cellcal.presence/1";
constexpr std::size_t kLargestPresence = std::size_t{1} << 14;

const fields::Table<Presence>& presence_fields() {
  using T = Presence;
  static const fields::Table<T> kTable{field("online", &T::online, fields::flag()),
                                       field("farewell", &T::farewell, fields::flag()),
                                       field("journal", &T::journal, name()),
                                       field("number", &T::number, count<std::int64_t>()),
                                       field("software", &T::software, line()),
                                       field("time", &T::time, line()),
                                       field("mock", &T::mock, fields::flag())};
  return kTable;
}

}  // namespace

std::string to_json(const Presence& presence) {
  fields::Json json{
      {"format", kPresenceFormat}, {"plant", presence.of.plant}, {"cell", presence.of.cell}};
  json.update(fields::to_json(presence_fields(), presence));
  return json.dump(-1, ' ', false, fields::Json::error_handler_t::replace);
}

Presence presence_from_json(std::string_view json, const Topic& topic) {
  const std::string where = to_text(topic);
  const nlohmann::json parsed = json_of(json, kLargestPresence, where);
  const calib::JsonReader reader(parsed, where);
  Presence presence;
  presence.of = sender(reader, kPresenceFormat, topic);
  fields::from_json(presence_fields(), reader, presence);
  return presence;
}

namespace {

using Json = calib::fields::Json;

constexpr const char* kStoredFormat = "cellcal.stored/1";
constexpr std::size_t kLargestStored = std::size_t{1} << 16;

std::pair<std::int64_t, std::int64_t> range_of(const calib::JsonReader& reader) {
  const auto ends = reader.items();
  if (ends.size() != 2) reader.fail("must hold two numbers");
  const auto number = count<std::int64_t>();
  const std::pair range{number.from(ends[0]), number.from(ends[1])};
  if (range.first < 1 || range.second < range.first) reader.fail("must go from 1 or more upwards");
  return range;
}

}  // namespace

bool Stored::has(std::int64_t number) const {
  return std::any_of(numbers.begin(), numbers.end(), [&](const auto& range) {
    return range.first <= number && number <= range.second;
  });
}

std::string to_json(const Stored& stored) {
  Json ranges = Json::array();
  for (const auto& [from, to] : stored.numbers) ranges.push_back({from, to});
  return Json{{"format", kStoredFormat},
              {"plant", stored.of.plant},
              {"cell", stored.of.cell},
              {"journal", stored.journal},
              {"numbers", std::move(ranges)}}
      .dump(-1, ' ', false, Json::error_handler_t::replace);
}

Stored stored_from_json(std::string_view json, const Topic& topic) {
  const std::string where = to_text(topic);
  const nlohmann::json parsed = json_of(json, kLargestStored, where);
  const calib::JsonReader reader(parsed, where);
  Stored stored;
  stored.of = sender(reader, kStoredFormat, topic);
  stored.journal = name().from(reader.at("journal"));
  const auto ranges = reader.at("numbers").items();
  if (ranges.size() > kMostStoredRanges) reader.at("numbers").fail("has too many ranges");
  for (const calib::JsonReader& range : ranges) stored.numbers.push_back(range_of(range));
  return stored;
}

namespace {

constexpr const char* kProposalFormat = "cellcal.proposal/1";
constexpr std::size_t kLargestProposal = std::size_t{1} << 18;

constexpr EnumNames<ProposalKind> kProposalKinds{{{ProposalKind::kCalibrate, "calibrate"},
                                                  {ProposalKind::kCheck, "check"},
                                                  {ProposalKind::kActivate, "activate"},
                                                  {ProposalKind::kSchedule, "schedule"},
                                                  {ProposalKind::kPriors, "priors"},
                                                  {ProposalKind::kWithdraw, "withdraw"}}};

const fields::Table<Proposal>& proposal_fields() {
  using T = Proposal;
  static const fields::Table<T> kTable{field("id", &T::id, name()),
                                       field("kind", &T::kind, fields::named(kProposalKinds)),
                                       field("session", &T::session, count<std::int64_t>()),
                                       field("text", &T::text, bounded(kLongestText)),
                                       field("by", &T::by, line()),
                                       field("reason", &T::reason, bounded(kLongestText)),
                                       field("time", &T::time, line())};
  return kTable;
}

}  // namespace

const char* to_string(ProposalKind kind) { return kProposalKinds[kind]; }

Json message_of(const Proposal& proposal) {
  Json json{{"format", kProposalFormat}, {"plant", proposal.of.plant}, {"cell", proposal.of.cell}};
  json.update(fields::to_json(proposal_fields(), proposal));
  return json;
}

std::string to_json(const Proposal& proposal) {
  return message_of(proposal).dump(-1, ' ', false, Json::error_handler_t::replace);
}

Proposal proposal_from_json(std::string_view json, const Topic& topic) {
  return proposal_in(json_of(json, kLargestProposal, to_text(topic)), topic);
}

Proposal proposal_in(const nlohmann::json& message, const Topic& topic) {
  const calib::JsonReader reader(message, to_text(topic));
  Proposal proposal;
  proposal.of = sender(reader, kProposalFormat, topic);
  fields::from_json(proposal_fields(), reader, proposal);
  if (proposal.id != topic.kind) reader.at("id").fail("differs from the topic");
  return proposal;
}

}  // namespace cellcal::daemon::plant
