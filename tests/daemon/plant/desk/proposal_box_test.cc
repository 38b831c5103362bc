#include "daemon/plant/desk/proposal_box.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <set>

#include "calib/files/input_file.h"
#include "calib/files/priors_file.h"
#include "calib/model/error.h"
#include "tests/daemon/journal/temporary_directory.h"

namespace cellcal::daemon::plant {
namespace {

using daemon::testing::TemporaryDirectory;

struct AProposalBox : ::testing::Test {
  static Proposal proposal(const std::string& id, ProposalKind kind = ProposalKind::kCheck,
                           const std::string& text = "") {
    return {{"graz", "weld-3"}, id,      kind,  kind == ProposalKind::kActivate ? 7 : 0, text,
            "M. Huber",         "drift", "2026"};
  }
  ProposalBox box() {
    return ProposalBox({dir.path(),
                        [this](const Proposal& which, const Say& say) {
                          if (in_the_way) throw std::runtime_error("a session is under way");
                          activated.push_back(std::to_string(which.session) + " " + say.by);
                        },
                        [this](const AnswerFact& answer, Worth worth) {
                          if (mute) throw std::runtime_error("no space left");
                          answers.push_back(answer);
                          worths.push_back(worth);
                        },
                        [this](ProposalKind kind) { return policy.contains(kind); },
                        [this] { return robot; }});
  }
  NotDecided::Why why_not(const std::function<void()>& act) {
    try {
      act();
    } catch (const NotDecided& refused) {
      return refused.why;
    }
    ADD_FAILURE() << "it was decided";
    return {};
  }

  TemporaryDirectory dir;
  std::vector<std::string> activated;
  std::vector<AnswerFact> answers;
  std::vector<Worth> worths;
  std::set<ProposalKind> policy;
  CellRobot robot;
  bool in_the_way = false, mute = false;
  const Say anna{"anna", "fits", "t1"};
};

TEST_F(AProposalBox, LeavesNothingToAnswerOfWhatThePlantWithdrawsButWhatWasDecided) {
  ProposalBox kept = box();
  kept.take(proposal("p-1"), "t0");
  kept.take(proposal("p-2"), "t0");
  kept.accept("p-2", anna);
  for (const char* id : {"p-1", "p-2", "p-3"})
    kept.take(proposal(id, ProposalKind::kWithdraw), "t1");
  EXPECT_EQ(why_not([&] { kept.accept("p-1", anna); }), NotDecided::Why::kDecided);
  EXPECT_EQ(box().all()[2].stand, Stand::kWithdrawn);
  EXPECT_EQ(kept.all()[1].stand, Stand::kAccepted);
  EXPECT_EQ(kept.take(proposal("p-3"), "t2"), Stand::kWithdrawn) << "it came late";
  ASSERT_EQ(answers.size(), 3U);
  EXPECT_EQ(answers[1], (AnswerFact{"p-1", false, "M. Huber", "withdrawn: drift"}));
}

TEST_F(AProposalBox, KeepsWhatIsProposedUntilSomebodySaysSomethingAlsoAcrossARestart) {
  EXPECT_EQ(box().take(proposal("p-1"), "t0"), Stand::kOpen);
  ProposalBox again = box();
  ASSERT_EQ(again.all().size(), 1U);
  EXPECT_EQ(again.all()[0], (StoredProposal{proposal("p-1"), "t0", Stand::kOpen, "", "", ""}));
  EXPECT_TRUE(answers.empty());
  EXPECT_EQ(again.accept("p-1", anna).stand, Stand::kAccepted);
  EXPECT_EQ(answers, (std::vector<AnswerFact>{{"p-1", true, "anna", "fits"}}));
  EXPECT_EQ(box().all()[0],
            (StoredProposal{proposal("p-1"), "t0", Stand::kAccepted, "t1", "anna", "fits", true}));
  EXPECT_EQ(why_not([&] { again.refuse("p-1", anna); }), NotDecided::Why::kDecided);
  EXPECT_EQ(why_not([&] { again.accept("p-2", anna); }), NotDecided::Why::kUnknown);
}

TEST_F(AProposalBox, TakesTheSameOneOnce) {
  ProposalBox all = box();
  EXPECT_EQ(all.take(proposal("p-1"), "t0"), Stand::kOpen);
  EXPECT_EQ(all.take(proposal("p-1", ProposalKind::kActivate), "t1"), Stand::kOpen);
  all.refuse("p-1", {"anna", "no", "t2"});
  EXPECT_EQ(all.take(proposal("p-1"), "t3"), Stand::kRefused);
  EXPECT_EQ(answers, (std::vector<AnswerFact>{{"p-1", false, "anna", "no"}}));
  EXPECT_EQ(all.all().size(), 1U);
}

TEST_F(AProposalBox,
       PutsACalibrationIntoUseOnlyWhenThatWasAcceptedAndLeavesItOpenWhereThatCannotBe) {
  ProposalBox all = box();
  all.take(proposal("p-1", ProposalKind::kActivate), "t0");
  EXPECT_TRUE(activated.empty());
  in_the_way = true;
  EXPECT_THROW(all.accept("p-1", anna), std::runtime_error);
  EXPECT_EQ(box().all()[0].stand, Stand::kOpen);
  EXPECT_TRUE(answers.empty());
  in_the_way = false;
  all.accept("p-1", anna);
  EXPECT_EQ(activated, (std::vector<std::string>{"7 anna"}));
}

std::string priors_of(const std::string& nominal_geometry) {
  calib::FleetPriors priors;
  priors.made = "2026-11-22T20:00:00Z";
  priors.robot = "KR 10 R900";
  priors.nominal_geometry = nominal_geometry;
  priors.arms = 3;
  priors.joints = {{"A1", {}, 0.0}};
  return calib::priors_to_toml(priors);
}

TEST_F(AProposalBox, RefusesPriorsOfAnotherModelAndHasTheWholeCommandForOthers) {
  const std::string own(64, 'a'), other(64, 'b');
  ProposalBox all = box();
  all.take(proposal("p-1", ProposalKind::kPriors, priors_of(other)), "t0");  // no session yet
  robot = {"/etc/cells/my arm.toml", "KR 5 R1400", own};
  EXPECT_EQ(why_not([&] { all.accept("p-1", anna); }), NotDecided::Why::kUnusable);
  EXPECT_EQ(all.take(proposal("p-2", ProposalKind::kPriors, priors_of(other)), "t0"),
            Stand::kRefused);
  EXPECT_EQ(all.all()[0].reason,
            "priors of KR 10 R900, nominal geometry bbbbbbbbbbbb; this cell's KR 5 R1400 has "
            "aaaaaaaaaaaa. Use priors learned from this model");
  all.take(proposal("p-3", ProposalKind::kPriors, priors_of(own)), "t0");
  const Proposal accepted = all.accept("p-3", anna).proposal;
  EXPECT_EQ(all.command_of(accepted), "cellcal priors accept " + all.file_of(accepted).string() +
                                          " --robot '/etc/cells/my arm.toml' -o NEW.toml");
  EXPECT_EQ(all.command_of(proposal("p-4")), "");
}

TEST_F(AProposalBox, AcceptsByItselfWhatTheConfigurationNamesAndNeverAScheduleOrPriors) {
  policy = {ProposalKind::kActivate, ProposalKind::kSchedule, ProposalKind::kPriors};
  ProposalBox all = box();
  all.take(proposal("p-1", ProposalKind::kActivate), "t0");
  all.take(proposal("p-2", ProposalKind::kSchedule, "resumes = 1\n"), "t0");
  all.take(proposal("p-3", ProposalKind::kPriors, "a = 1\n"), "t0");
  all.take(proposal("p-4", ProposalKind::kCheck), "t0");
  std::set<std::string> accepted;
  for (const StoredProposal& one : all.all())
    if (one.stand == Stand::kAccepted) accepted.insert(one.proposal.id);
  EXPECT_EQ(accepted, std::set<std::string>{"p-1"});
  EXPECT_EQ(activated.size(), 1U);
  in_the_way = true;
  EXPECT_EQ(all.take(proposal("p-5", ProposalKind::kActivate), "t0"), Stand::kOpen)
      << "it waits for somebody";
  in_the_way = false;
  EXPECT_EQ(all.take(proposal("p-5", ProposalKind::kActivate), "t1"), Stand::kAccepted)
      << "or for the next time";
}

TEST_F(AProposalBox, RefusesAScheduleThatIsNoneOrThatSpeaksForThePeopleOfTheCell) {
  ProposalBox all = box();
  for (const char* text :
       {"unattended = true\n", "responsible = \"me\"\n", "resumes = -1\n", "what = 1\n", "[[["}) {
    const std::string id = "p-" + std::to_string(answers.size());
    EXPECT_EQ(all.take(proposal(id, ProposalKind::kSchedule, text), "t0"), Stand::kRefused) << text;
    EXPECT_EQ(answers.back().by, "cellcald");
    EXPECT_FALSE(answers.back().reason.empty());
  }
  Proposal of_none = proposal("of-none", ProposalKind::kActivate);
  of_none.session = 0;
  all.take(of_none, "t0");
  EXPECT_EQ(all.all()[0].stand, Stand::kRefused);
  EXPECT_TRUE(activated.empty());
}

TEST_F(AProposalBox, WritesAnAcceptedScheduleAsItCameAndNothingBefore) {
  const std::string text = "# nights\nresumes = 1\n";
  ProposalBox all = box();
  all.take(proposal("p-1", ProposalKind::kSchedule, text), "t0");
  const auto file = all.file_of(all.all()[0].proposal);
  EXPECT_FALSE(std::filesystem::exists(file));
  all.accept("p-1", anna);
  EXPECT_EQ(calib::read_file(file), text);
}

TEST_F(AProposalBox, TakesNoMoreThanSomebodyCanRead) {
  ProposalBox all = box();
  for (std::size_t i = 0; i < 2 * kMostOpen; ++i)
    EXPECT_EQ(all.take(proposal("p-" + std::to_string(i)), "t0").has_value(), i < kMostOpen);
  for (std::size_t i = 0; i < 2 * kMostKept; ++i) {
    all.refuse(all.all()[0].proposal.id, anna);
    EXPECT_TRUE(all.take(proposal("q-" + std::to_string(i)), "t0").has_value());
  }
  EXPECT_EQ(all.all().size(), kMostKept);
  EXPECT_EQ(std::ranges::count(all.all(), Stand::kOpen, &StoredProposal::stand),
            static_cast<int>(kMostOpen));
}

constexpr const char* kUnusable = "unattended = true\n";

TEST_F(AProposalBox, CarriesOutNothingAgainHoweverManyUnusableOnesCameBetweenAndAcrossARestart) {
  policy = {ProposalKind::kActivate, ProposalKind::kCheck};
  const Proposal done = proposal("p-1", ProposalKind::kActivate);
  const Proposal refused = proposal("p-2", ProposalKind::kActivate);
  box().take(done, "t0");
  in_the_way = true;
  box().take(refused, "t0");
  box().refuse("p-2", anna);
  in_the_way = false;
  box().take(proposal("p-3"), "t0");
  for (int i = 0; i < 200; ++i)
    box().take(proposal("q-" + std::to_string(i), ProposalKind::kSchedule, kUnusable), "t0");
  const std::size_t answered = answers.size();
  ProposalBox again = box();
  EXPECT_EQ(again.take(done, "t1"), Stand::kAccepted);
  EXPECT_EQ(again.take(refused, "t1"), Stand::kRefused) << "a person said no to it";
  EXPECT_EQ(again.take(proposal("p-3"), "t1"), Stand::kAccepted);
  EXPECT_EQ(activated, std::vector<std::string>{"7 [plant] accept"});
  EXPECT_EQ(answers.size(), answered) << "nor is it answered again";
  EXPECT_EQ(again.all().size() + static_cast<std::size_t>(again.dropped()), 203U)
      << "what is gone is counted";
  EXPECT_GT(again.dropped(), 0);
}

TEST_F(AProposalBox, KeepsNoMoreBytesThanItsBoundHoweverLongWhatIsProposedIs) {
  const std::string words(std::size_t{1} << 16, 'x');
  StoredProposals accepted;  // by a person
  for (int i = 0; i < 36; ++i) {
    accepted.all.push_back({proposal("p-" + std::to_string(i), ProposalKind::kPriors, words), "t0",
                            Stand::kAccepted, "t0", "anna", "fits", true});
    accepted.all.back().proposal.reason = words;
  }
  std::ofstream(dir / "proposals.json") << proposals_to_json(accepted);
  ProposalBox all = box();
  for (int i = 0; i < 5; ++i) {
    const std::string id = "q-" + std::to_string(i);
    Proposal unusable = proposal(id, ProposalKind::kSchedule, words);
    unusable.reason = words;
    EXPECT_EQ(all.take(unusable, "t0"), Stand::kRefused);
  }
  EXPECT_LE(std::filesystem::file_size(dir / "proposals.json"), kMostKeptBytes + (1U << 18));
  ProposalBox again = box();
  for (const StoredProposal& one : accepted.all)
    EXPECT_EQ(again.take(one.proposal, "t1"), Stand::kAccepted) << one.proposal.id;
}

TEST_F(AProposalBox, IsReadAgainHoweverLongTheReasonWasForWhichSomethingWasWithdrawn) {
  for (const std::size_t more : {0, 1, 2}) {
    Proposal gone = proposal("p-" + std::to_string(more), ProposalKind::kWithdraw);
    gone.reason = std::string(more, 'x');
    while (gone.reason.size() + 2 <= std::size_t{1} << 16) gone.reason += "\xC3\xA9";
    box().take(gone, "t0");
    EXPECT_LE(answers.back().reason.size(), kLongestOwnReason);
  }
  EXPECT_EQ(box().problem(), "");
}

TEST_F(AProposalBox, PutsNothingIntoUseByItselfOnceItCannotRememberMore) {
  StoredProposals full;
  for (std::size_t i = 0; i < kMostLasting; ++i)
    full.all.push_back({proposal("p-" + std::to_string(i), ProposalKind::kActivate), "t0",
                        Stand::kAccepted, "t0", "[plant] accept", "", true});
  std::ofstream(dir / "proposals.json") << proposals_to_json(full);
  policy = {ProposalKind::kActivate};
  ProposalBox all = box();
  EXPECT_TRUE(all.full());
  EXPECT_EQ(all.take(proposal("new", ProposalKind::kActivate), "t1"), Stand::kOpen);
  all.accept("new", anna);
  EXPECT_EQ(all.take(proposal("newer", ProposalKind::kActivate), "t1"), Stand::kOpen);
  EXPECT_EQ(all.take(proposal("p-0", ProposalKind::kActivate), "t1"), Stand::kOpen)
      << "the oldest is forgotten and waits for somebody";
  EXPECT_EQ(activated, std::vector<std::string>{"7 anna"});
  EXPECT_LE(all.all().size(), kMostLasting + kMostOpen);
}

TEST_F(AProposalBox, LetsNoPlantFillTheJournalWithAnswersThatAreNeverDropped) {
  policy = {ProposalKind::kActivate, ProposalKind::kCheck};
  ProposalBox all = box();
  all.take(proposal("p-0", ProposalKind::kSchedule, kUnusable), "t0");
  all.take(proposal("p-1", ProposalKind::kWithdraw), "t0");
  all.take(proposal("p-2", ProposalKind::kCheck), "t0");
  all.take(proposal("p-3", ProposalKind::kActivate), "t0");
  all.take(proposal("p-4", ProposalKind::kCalibrate), "t0");
  all.refuse("p-4", anna);
  const Worth none = Worth::kTelemetry, result = Worth::kResult;
  EXPECT_EQ(worths, (std::vector<Worth>{none, none, none, result, result}));
}

TEST_F(AProposalBox, ADecisionThatCannotBeToldStandsAndIsToldWhenTheProposalComesAgain) {
  mute = true;
  box().take(proposal("p-1"), "t0");
  EXPECT_EQ(box().accept("p-1", anna).stand, Stand::kAccepted);
  EXPECT_EQ(box().take(proposal("p-2", ProposalKind::kSchedule, "unattended = true\n"), "t0"),
            Stand::kRefused);
  mute = false;
  ProposalBox again = box();
  again.take(proposal("p-1"), "t2");
  again.take(proposal("p-2", ProposalKind::kSchedule, "unattended = true\n"), "t2");
  again.take(proposal("p-1"), "t3");
  EXPECT_EQ(answers.size(), 2U);
  EXPECT_EQ(answers[0], (AnswerFact{"p-1", true, "anna", "fits"}));
  EXPECT_FALSE(answers[1].accepted);
}

TEST_F(AProposalBox, AcceptsNothingThatCannotBeUsedHoweverItGotThere) {
  const StoredProposal open{proposal("p-1", ProposalKind::kSchedule, "unattended = true\n"),
                            "t0",
                            Stand::kOpen,
                            "",
                            "",
                            ""};
  std::ofstream(dir / "proposals.json") << proposals_to_json({{open}});
  ProposalBox all = box();
  EXPECT_EQ(why_not([&] { all.accept("p-1", anna); }), NotDecided::Why::kUnusable);
  EXPECT_FALSE(std::filesystem::exists(all.file_of(open.proposal)));
}

TEST_F(AProposalBox, ADamagedFileIsKeptAndNothingIsTaken) {
  std::ofstream(dir / "proposals.json") << "{\"format\": \"cellcal.proposals/1\"";
  ProposalBox all = box();
  EXPECT_NE(all.problem().find("proposals.json"), std::string::npos);
  EXPECT_EQ(why_not([&] { all.take(proposal("p-1"), "t0"); }), NotDecided::Why::kStorage);
  EXPECT_TRUE(all.all().empty());
  EXPECT_EQ(calib::read_file(dir / "proposals.json"), "{\"format\": \"cellcal.proposals/1\"");
}

TEST(ProposalsFile, IsReadAsItWasWrittenAndRefusedWhereItIsCut) {
  const StoredProposals kept{
      {{AProposalBox::proposal("p-1", ProposalKind::kSchedule, "resumes = 1\n"), "t0",
        Stand::kRefused, "t1", "anna", "no"},
       {AProposalBox::proposal("p-2"), "t0", Stand::kOpen, "", "", ""}},
      12};
  const std::string text = proposals_to_json(kept);
  EXPECT_EQ(proposals_from_json(text, "f"), kept);
  for (std::size_t size = 0; size + 1 < text.size(); size += 7)
    EXPECT_THROW((void)proposals_from_json(text.substr(0, size), "f"), calib::FileError) << size;
}

}  // namespace
}  // namespace cellcal::daemon::plant
