#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "calib/model/error.h"
#include "daemon/plant/messages/fact.h"
#include "daemon/plant/messages/presence.h"
#include "one_of_each.h"

namespace cellcal::daemon::plant {
namespace {

using nlohmann::json;

Topic topic_for(const Fact& fact) { return {fact.of, Subject::kFact, kind_of(fact.body)}; }

/// The message of the refusal; empty: it was read.
std::string refusal(const std::string& text, const Topic& topic) {
  try {
    (void)fact_from_json(text, topic);
  } catch (const calib::FileError& refused) {
    return refused.what();
  }
  return "";
}

TEST(ACertificateForThePlant, ThatIsTooLargeIsRefusedByItsSize) {
  EXPECT_EQ(plant::certificate_fact("7-0", {{"a", std::string(5'000'000, 'x')}}).files.size(), 1u);
  try {
    plant::certificate_fact("7-0",
                            {{"a", std::string(5'000'000, 'x')}, {"b", std::string(600'000, 'x')}});
    FAIL();
  } catch (const plant::CertificateTooLarge& refused) {
    EXPECT_EQ(refused.bytes, 5'600'000u);
  }
  const plant::FactBody largest =
      plant::certificate_fact("7-0", {{"a", std::string(plant::kMostCertificateBytes, '\xff')}});
  EXPECT_LT(plant::to_json(plant::Fact{{"graz", "w"}, "j", 1, "t", 1, largest}).size(),
            plant::kLargestMessage);
}

TEST(Facts, OfEachKindAreReadAsTheyWereWritten) {
  ASSERT_EQ(one_of_each().size(), std::variant_size_v<FactBody>);
  for (const FactBody& body : one_of_each()) {
    const Fact fact = fact_of(body);
    const Fact again = fact_from_json(to_json(fact), topic_for(fact));
    EXPECT_EQ(to_json(again), to_json(fact));
    EXPECT_EQ(again.body.index(), body.index());
    // Degrees are not restored to the last bit.
    const bool exact = !std::holds_alternative<TouchFact>(body);
    EXPECT_TRUE(!exact || again == fact) << kind_of(body);
    EXPECT_EQ(body_from_json(kind_of(body), body_to_json(body)).index(), body.index());
  }
}

TEST(Facts, SayWhyOneWasDropped) {
  for (const DropReason reason :
       {DropReason::kNoRoom, DropReason::kTooLarge, DropReason::kDamaged}) {
    const FactBody dropped = DroppedFact{7, 7, 1, reason, "calibration", std::nullopt};
    EXPECT_EQ(body_from_json("dropped", body_to_json(dropped)), dropped);
  }
}

TEST(Facts, HaveMillimetresAndDegreesOutsideAndSIInside) {
  TouchFact touch;
  touch.joint_rad = {0.5};
  touch.tip_m = std::array{1.5, 0.0, -0.25};
  touch.residual_m = 0.125e-3;
  const json body = json::parse(to_json(fact_of(touch))).at("body");
  EXPECT_NEAR(body.at("joints_deg").at(0).get<double>(), 28.6478897565, 1e-9);
  EXPECT_EQ(body.at("tip_mm").at(0), 1500.0);
  EXPECT_EQ(body.at("residual_mm"), 0.125);
  const json check =
      json::parse(to_json(fact_of(CheckFact{7, Held::kYes, 0.5e-3, 0.125e-3, "", {}, "{}"})))
          .at("body");
  EXPECT_EQ(check.at("shift_mm"), 0.5);
  EXPECT_FALSE(check.contains("temperature_c"));
}

TEST(Facts, AnyKeyThatIsLeftOutIsNamed) {
  for (const FactBody& body : one_of_each()) {
    const Fact fact = fact_of(body);
    const json whole = json::parse(to_json(fact));
    for (const auto& [key, value] : whole.items()) {
      json less = whole;
      less.erase(key);
      EXPECT_NE(refusal(less.dump(), topic_for(fact)).find(key), std::string::npos) << key;
    }
    int optional = 0;
    for (const auto& [key, value] : whole.at("body").items()) {
      json less = whole;
      less.at("body").erase(key);
      const std::string said = refusal(less.dump(), topic_for(fact));
      optional += said.empty() ? 1 : 0;
      EXPECT_TRUE(said.empty() || said.find(key) != std::string::npos) << said;
    }
    EXPECT_LE(optional, 4) << kind_of(body);
  }
}

TEST(Facts, AnyKeyOfAnotherTypeIsNamed) {
  for (const FactBody& body : one_of_each()) {
    const Fact fact = fact_of(body);
    const json whole = json::parse(to_json(fact));
    for (const auto& [key, value] : whole.items()) {
      json other = whole;
      other[key] = json::array({json::object()});
      EXPECT_NE(refusal(other.dump(), topic_for(fact)).find(key), std::string::npos) << key;
    }
    for (const auto& [key, value] : whole.at("body").items())
      for (const json& wrong :
           {json(nullptr), json::array({json::object()}), json(json::value_t::object)}) {
        json other = whole;
        other["body"][key] = wrong;
        EXPECT_NE(refusal(other.dump(), topic_for(fact)).find(key), std::string::npos)
            << kind_of(body) << " " << key << " " << wrong;
      }
  }
}

TEST(Facts, CutAnywhereAreRefused) {
  for (const FactBody& body : one_of_each()) {
    const Fact fact = fact_of(body);
    const std::string text = to_json(fact);
    for (std::size_t size = 0; size < text.size(); ++size)
      EXPECT_NE(refusal(text.substr(0, size), topic_for(fact)), "") << size;
  }
}

TEST(Facts, OfAnotherCellThanTheTopicsAreRefused) {
  const Fact fact = fact_of(PhaseFact{});
  EXPECT_EQ(refusal(to_json(fact), topic_for(fact)), "");
  EXPECT_NE(refusal(to_json(fact), {{"graz", "weld-4"}, Subject::kFact, "phase"}), "");
  EXPECT_NE(refusal(to_json(fact), {{"linz", "weld-3"}, Subject::kFact, "phase"}), "");
  EXPECT_NE(refusal(to_json(fact), {{"graz", "weld-3"}, Subject::kFact, "touch"}), "");
  EXPECT_NE(refusal(to_json(fact), {{"graz", "weld-3"}, Subject::kPresence, ""}), "");
}

TEST(Facts, WithAHostileValueAreRefused) {
  const Fact touch = fact_of(one_of_each()[8]);
  const auto with = [&](const char* pointer, const json& value) {
    json other = json::parse(to_json(touch));
    other[json::json_pointer(pointer)] = value;
    return refusal(other.dump(), topic_for(touch));
  };
  EXPECT_EQ(with("/body/index", 5), "");
  for (const json& number : {json(-1), json(0.5), json(1e300), json("17"), json(0)})
    EXPECT_NE(with("/number", number), "") << number;
  EXPECT_NE(with("/journal", "a/b"), "");
  EXPECT_NE(with("/plant", "graz/weld"), "");
  EXPECT_NE(with("/id", "0123abcd-18"), "");
  EXPECT_NE(with("/time", std::string("2026\n")), "");
  EXPECT_NE(with("/body/target", std::string(100000, 'S')), "");
  EXPECT_NE(with("/body/target", std::string("S\x1b[2J")), "");
  EXPECT_NE(with("/body/joints_deg", std::vector<double>(10000, 1.0)), "");
  EXPECT_NE(with("/body/tip_mm", {1, 2}), "");
  EXPECT_NE(with("/format", "cellcal.plant/2"), "");
  EXPECT_NE(with("/body/index", 1e300), "");
  EXPECT_NE(refusal(std::string(1 << 20, '['), topic_for(touch)), "");
  EXPECT_NE(refusal(std::string(kLargestMessage + 1, ' '), topic_for(touch)), "");
  std::string infinite = to_json(touch);
  infinite.replace(infinite.find("\"index\":3"), 9, "\"index\":1e999");
  EXPECT_NE(refusal(infinite, topic_for(touch)), "");
}

TEST(Facts, WhoseDocumentWasChangedAreRefused) {
  for (const std::size_t which : {1U, 2U}) {
    const Fact fact = fact_of(one_of_each()[which]);
    json changed = json::parse(to_json(fact));
    changed["body"]["document"]["text"] = "{\"a\": 2}\n";
    EXPECT_NE(refusal(changed.dump(), topic_for(fact)).find("sha256"), std::string::npos);
  }
  const Fact fact = fact_of(one_of_each()[4]);
  for (const char* name : {"", "../up", "/etc/passwd", ".hidden"}) {
    json changed = json::parse(to_json(fact));
    changed["body"]["files"][0]["name"] = name;
    EXPECT_NE(refusal(changed.dump(), topic_for(fact)).find("name"), std::string::npos) << name;
  }
  json changed = json::parse(to_json(fact));
  changed["body"]["files"][0]["base64"] = "e30K";
  EXPECT_NE(refusal(changed.dump(), topic_for(fact)).find("sha256"), std::string::npos);
}

TEST(Facts, WithKeysOfANewerCellAreRead) {
  const Fact fact = fact_of(PhaseFact{"a", "b", "c", 1.0});
  json newer = json::parse(to_json(fact));
  newer["more"] = 1;
  newer["body"]["more"] = json::array();
  EXPECT_EQ(fact_from_json(newer.dump(), topic_for(fact)), fact);
}

TEST(Facts, OfKindsThatNobodyKnowsAreRefused) {
  Fact fact = fact_of(PhaseFact{});
  json newer = json::parse(to_json(fact));
  newer["kind"] = "weather";
  EXPECT_NE(refusal(newer.dump(), {fact.of, Subject::kFact, "weather"}).find("unknown kind"),
            std::string::npos);
}

TEST(Presence, IsReadAsItWasWritten) {
  const Presence presence{{"graz", "weld-3"},     true, false, "0123", 17, "1.9.0",
                          "2026-11-22T20:00:00Z", true};
  const Topic topic{presence.of, Subject::kPresence, ""};
  EXPECT_EQ(presence_from_json(to_json(presence), topic), presence);
  EXPECT_THROW((void)presence_from_json(to_json(presence), {{"graz", "b"}, Subject::kPresence, ""}),
               calib::FileError);
  const json whole = json::parse(to_json(presence));
  for (const auto& [key, value] : whole.items()) {
    json less = whole;
    less.erase(key);
    EXPECT_THROW((void)presence_from_json(less.dump(), topic), calib::FileError) << key;
  }
}

TEST(Stored, IsReadAsItWasWrittenAndRefusedWhereItIsNone) {
  const Stored stored{{"graz", "weld-3"}, "0123", {{1, 17}, {19, 19}}};
  const Topic topic{stored.of, Subject::kStored, ""};
  EXPECT_EQ(stored_from_json(to_json(stored), topic), stored);
  for (const std::int64_t number : {1, 17, 19}) EXPECT_TRUE(stored.has(number));
  for (const std::int64_t number : {0, 18, 20}) EXPECT_FALSE(stored.has(number));
  EXPECT_THROW((void)stored_from_json(to_json(stored), {{"graz", "b"}, Subject::kStored, ""}),
               calib::FileError);
  const json whole = json::parse(to_json(stored));
  for (const json& wrong :
       {json(3), json{1, 2}, json{{0, 3}}, json{{3, 2}}, json{{1, 2, 3}}, json{{1, 1e300}},
        json{{1, "2"}}, json(std::vector<std::vector<int>>(kMostStoredRanges + 1, {1, 2}))}) {
    json other = whole;
    other["numbers"] = wrong;
    EXPECT_THROW((void)stored_from_json(other.dump(), topic), calib::FileError) << wrong;
  }
}

TEST(Proposals, AreReadAsTheyWereWritten) {
  for (const ProposalKind kind :
       {ProposalKind::kCalibrate, ProposalKind::kCheck, ProposalKind::kActivate,
        ProposalKind::kSchedule, ProposalKind::kPriors}) {
    const Proposal proposal{{"graz", "weld-3"}, "p-1",   kind,  7, "[[entry]]\nname = \"night\"\n",
                            "M. Huber",         "drift", "2026"};
    const Topic topic{proposal.of, Subject::kProposal, "p-1"};
    EXPECT_THROW(
        (void)proposal_from_json(to_json(proposal), {proposal.of, Subject::kProposal, "p-2"}),
        calib::FileError);
    EXPECT_EQ(proposal_from_json(to_json(proposal), topic), proposal) << to_string(kind);
    json other = json::parse(to_json(proposal));
    other["kind"] = "move";
    EXPECT_THROW((void)proposal_from_json(other.dump(), topic), calib::FileError);
  }
}

}  // namespace
}  // namespace cellcal::daemon::plant
