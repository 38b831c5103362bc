#include "daemon/plant/proposals/proposals_file.h"

#include "calib/files/json.h"
#include "daemon/plant/messages/text_fields.h"

namespace cellcal::daemon::plant {

namespace {

namespace fields = calib::fields;
using fields::field;

constexpr const char* kFormat = "cellcal.proposals/1";
constexpr std::size_t kLargest = kMostKept * (std::size_t{1} << 18);

/// As the message has it, in an object of its own.
fields::Value<Proposal> proposal() {
  return {[](const Proposal& p) { return calib::parse_ordered_json(to_json(p)); },
          [](const calib::JsonReader& reader) {
            const CellName of{reader.at("plant").text(), reader.at("cell").text()};
            return proposal_from_json(calib::write_json(reader.object()),
                                      {of, Subject::kProposal, reader.at("id").text()});
          }};
}

const fields::Table<KeptProposal>& kept_fields() {
  using T = KeptProposal;
  static const fields::Table<T> kTable{
      field("proposal", &T::proposal, proposal()),
      field("received", &T::received, line()),
      field("stand", &T::stand,
            fields::word<Stand>({{Stand::kOpen, "open"},
                                 {Stand::kAccepted, "accepted"},
                                 {Stand::kRefused, "refused"},
                                 {Stand::kWithdrawn, "withdrawn"}})),
      field("decided", &T::decided, line()),
      field("by", &T::by, line()),
      field("reason", &T::reason, bounded(kLongestText)),
      fields::optional(field("told", &T::reported, fields::flag()))};
  return kTable;
}

}  // namespace

std::string proposals_to_json(const KeptProposals& kept) {
  return calib::write_lines(
      {{"format", kFormat},
       {"dropped", kept.dropped},
       {"proposals", fields::list(fields::object(kept_fields())).to(kept.all)}});
}

KeptProposals proposals_from_json(std::string_view json, const std::string& name) {
  const nlohmann::json parsed = json_of(json, kLargest, name);
  const calib::JsonReader reader(parsed, name);
  if (reader.at("format").text() != kFormat)
    reader.at("format").fail(std::string("must be \"") + kFormat + '"');
  return {fields::list(fields::object(kept_fields())).from(reader.at("proposals")),
          reader.has("dropped") ? count<std::int64_t>().from(reader.at("dropped")) : 0};
}

}  // namespace cellcal::daemon::plant
