#include "daemon/plant/messages/proposal.h"

#include "daemon/plant/messages/text_fields.h"

namespace cellcal::daemon::plant {

namespace {

namespace fields = calib::fields;
using fields::field;

constexpr const char* kProposalFormat = "cellcal.proposal/1";
constexpr std::size_t kLargestProposal = std::size_t{1} << 18;

const std::vector<std::pair<ProposalKind, const char*>>& kinds() {
  static const std::vector<std::pair<ProposalKind, const char*>> kAll{
      {ProposalKind::kCalibrate, "calibrate"}, {ProposalKind::kCheck, "check"},
      {ProposalKind::kActivate, "activate"},   {ProposalKind::kSchedule, "schedule"},
      {ProposalKind::kPriors, "priors"},       {ProposalKind::kWithdraw, "withdraw"}};
  return kAll;
}

const fields::Table<Proposal>& proposal_fields() {
  using T = Proposal;
  static const fields::Table<T> kTable{field("id", &T::id, name()),
                                       field("kind", &T::kind, fields::word<ProposalKind>(kinds())),
                                       field("session", &T::session, count<std::int64_t>()),
                                       field("text", &T::text, bounded(kLongestText)),
                                       field("by", &T::by, line()),
                                       field("reason", &T::reason, bounded(kLongestText)),
                                       field("time", &T::time, line())};
  return kTable;
}

}  // namespace

const char* to_string(ProposalKind kind) {
  for (const auto& [one, name] : kinds())
    if (one == kind) return name;
  return "";
}

std::string to_json(const Proposal& proposal) {
  fields::Json json{
      {"format", kProposalFormat}, {"plant", proposal.of.plant}, {"cell", proposal.of.cell}};
  json.update(fields::to_json(proposal_fields(), proposal));
  return json.dump(-1, ' ', false, fields::Json::error_handler_t::replace);
}

Proposal proposal_from_json(std::string_view json, const Topic& topic) {
  const std::string where = to_text(topic);
  const nlohmann::json parsed = json_of(json, kLargestProposal, where);
  const calib::JsonReader reader(parsed, where);
  if (reader.at("format").text() != kProposalFormat)
    reader.at("format").fail(std::string("must be \"") + kProposalFormat + '"');
  Proposal proposal;
  proposal.of = {name().from(reader.at("plant")), name().from(reader.at("cell"))};
  if (proposal.of != topic.of) reader.at("cell").fail("differs from the topic");
  fields::from_json(proposal_fields(), reader, proposal);
  if (proposal.id != topic.kind) reader.at("id").fail("differs from the topic");
  return proposal;
}

}  // namespace cellcal::daemon::plant
