// plant.schema.json compared with written and read messages: the same keys, the same required ones.

#include "tests/daemon/api/schema.h"

#include <gtest/gtest.h>

#include "calib/model/error.h"
#include "daemon/plant/messages/fact.h"
#include "daemon/plant/messages/presence.h"
#include "one_of_each.h"

namespace cellcal::daemon::plant {
namespace {

using daemon::testing::Description;
using nlohmann::json;

const Description& description() {
  static const Description kOne(CELLCAL_PLANT_SCHEMA);
  return kOne;
}

json definition(const std::string& name) { return description().document().at("$defs").at(name); }

void expect_described(const json& message, const json& schema) {
  const json any{{"oneOf", description().document().at("oneOf")}};
  EXPECT_EQ(description().complaint(message, any), "");
  EXPECT_EQ(description().complaint(message, schema), "");
  for (const auto& [key, value] : message.items())
    EXPECT_TRUE(schema.at("properties").contains(key)) << key;
  EXPECT_EQ(message.size(), schema.at("properties").size()) << "nothing is described in vain";
}

bool is_read(const json& fact, const Topic& topic) {
  try {
    (void)fact_from_json(fact.dump(), topic);
    return true;
  } catch (const calib::FileError&) {
    return false;
  }
}

TEST(TheSchema, DescribesWhatIsWrittenOfEachKindAndWhatIsRequiredToBeRead) {
  for (const FactBody& body : one_of_each()) {
    const Fact fact = fact_of(body);
    const Topic topic{fact.of, Subject::kFact, kind_of(body)};
    const json written = json::parse(to_json(fact));
    const std::string kind = kind_of(body);
    expect_described(written, definition("fact_" + kind));
    const json schema = definition("body_" + kind);
    for (const auto& [key, value] : schema.at("properties").items()) {
      json less = written;
      less.at("body").erase(key);
      const auto& required = schema.at("required");
      const bool is_required = std::find(required.begin(), required.end(), key) != required.end();
      EXPECT_EQ(is_read(less, topic), !is_required) << kind << "." << key;
      EXPECT_EQ(description().complaint(less, definition("fact_" + kind)).empty(), !is_required);
      if (written.at("body").contains(key)) continue;
      // Not a key of this example, such as a mean error that a calibration does not predict.
      EXPECT_FALSE(is_required) << kind << "." << key;
    }
    for (const auto& [key, value] : written.at("body").items())
      EXPECT_TRUE(schema.at("properties").contains(key)) << kind << "." << key;
  }
}

TEST(TheSchema, DescribesPresenceStoredAndProposal) {
  const CellName of{"graz", "weld-3"};
  expect_described(json::parse(to_json(Presence{of, true, false, "j", 3, "1", "t", true})),
                   definition("presence"));
  expect_described(json::parse(to_json(Stored{of, "j", {{1, 3}, {7, 7}}})), definition("stored"));
  Proposal proposal;
  proposal.of = of;
  proposal.id = "p-1";
  for (const ProposalKind kind :
       {ProposalKind::kCalibrate, ProposalKind::kCheck, ProposalKind::kActivate,
        ProposalKind::kSchedule, ProposalKind::kPriors, ProposalKind::kWithdraw}) {
    proposal.kind = kind;
    expect_described(json::parse(to_json(proposal)), definition("proposal"));
  }
}

TEST(TheSchema, RefusesAnotherVersionAndAnotherKind) {
  json other = json::parse(to_json(fact_of(PhaseFact{})));
  const json any{{"oneOf", description().document().at("oneOf")}};
  EXPECT_EQ(description().complaint(other, any), "");
  other["format"] = "cellcal.plant/2";
  EXPECT_NE(description().complaint(other, any), "");
  other["format"] = "cellcal.plant/1";
  other["kind"] = "touch";
  EXPECT_NE(description().complaint(other, any), "");
}

}  // namespace
}  // namespace cellcal::daemon::plant
