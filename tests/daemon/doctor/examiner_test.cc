// One examination at a time, and none during a session.

#include "daemon/doctor/examiner.h"

#include <gtest/gtest.h>

#include <condition_variable>
#include <fstream>
#include <stdexcept>

#include "calib/files/input_file.h"
#include "daemon/doctor/steps.h"
#include "tests/daemon/journal/temporary_directory.h"

namespace cellcal::daemon {
namespace {

struct AnExaminer : ::testing::Test {
  /// Runs until released, or requested to stop.
  void run_checks(Findings& findings, const std::function<void(const calib::Phrase&)>& hint,
                  const std::stop_token& stop) {
    hint("start CELLCAL_RSI");
    findings.ok("configuration", "as it is");
    std::unique_lock lock(mutex);
    running = true;
    changed.notify_all();
    changed.wait(lock, stop, [this] { return let_go; });
    if (breaks) throw std::runtime_error("broke");
    findings.warn("plan", "far", "widen");
  }
  void wait_until_running() {
    std::unique_lock lock(mutex);
    changed.wait(lock, [this] { return running; });
  }
  void release() {
    const std::lock_guard lock(mutex);
    let_go = true;
    changed.notify_all();
  }
  void wait_until_free() {
    std::unique_lock lock(mutex);
    changed.wait(lock, [this] { return held == 0; });
  }

  std::mutex mutex;
  std::condition_variable_any changed;
  bool running = false, let_go = false, breaks = false, session = false;
  int held = 0;
  testing::TemporaryDirectory dir;
  std::string config = "c1";
  Examiner::Parts parts{[this](const std::filesystem::path&, Findings& findings, const auto& hint,
                               std::stop_token stop) { run_checks(findings, hint, stop); },
                        [this] {
                          const std::lock_guard lock(mutex);
                          if (session || held > 0) throw std::runtime_error("busy");
                          ++held;
                        },
                        [this] {
                          const std::lock_guard lock(mutex);
                          --held;
                          changed.notify_all();
                        },
                        [] { return "t"; },
                        [this] { return config; },
                        dir / "doctor.json"};
  Examiner examiner{parts};
};

TEST_F(AnExaminer, TellsOfEachFindingAsItComes) {
  EXPECT_FALSE(examiner.newest().running);
  EXPECT_FALSE(examiner.newest().green()) << "nothing was looked at";
  examiner.begin("/c.toml");
  wait_until_running();
  Examination now = examiner.newest();
  EXPECT_TRUE(now.running);
  EXPECT_FALSE(now.green());
  EXPECT_EQ(now.hint, "start CELLCAL_RSI");
  EXPECT_EQ(now.checks.size(), 1u);
  release();
  wait_until_free();
  now = examiner.newest();
  EXPECT_FALSE(now.running);
  EXPECT_TRUE(now.green()) << "warnings are allowed";
  EXPECT_EQ(now.hint, "");
  EXPECT_EQ(now.ended, "t");
  EXPECT_EQ(now.checks.size(), 2u);
}

TEST_F(AnExaminer, DoesNotLookBesideASessionAndKeepsWhatItFound) {
  let_go = true;
  examiner.begin("/c.toml");
  wait_until_free();
  session = true;
  EXPECT_THROW(examiner.begin("/d.toml"), std::runtime_error);
  EXPECT_EQ(examiner.newest().cell, "/c.toml");
  EXPECT_TRUE(examiner.newest().green());
}

TEST_F(AnExaminer, LooksOnceAtATimeAndAgainAfterwards) {
  examiner.begin("/c.toml");
  wait_until_running();
  EXPECT_THROW(examiner.begin("/d.toml"), std::runtime_error);
  release();
  wait_until_free();
  examiner.begin("/d.toml");
  wait_until_free();
  EXPECT_EQ(examiner.newest().cell, "/d.toml");
}

TEST_F(AnExaminer, EndsWhenItIsStoppedAndThenIsNotGreen) {
  examiner.begin("/c.toml");
  wait_until_running();
  examiner.stop();
  EXPECT_FALSE(examiner.newest().running);
  EXPECT_FALSE(examiner.newest().green());
  EXPECT_EQ(held, 0);
  examiner.begin("/d.toml");
  EXPECT_EQ(examiner.newest().cell, "/c.toml") << "nothing begins any more";
  EXPECT_EQ(held, 0);
}

TEST_F(AnExaminer, ThatBreaksHasFailedAndLetsSessionsBegin) {
  breaks = let_go = true;
  examiner.begin("/c.toml");
  wait_until_free();
  EXPECT_EQ(examiner.newest().count(Outcome::kFailed), 1u);
}

TEST_F(AnExaminer, KnowsAfterARestartWhatItFoundAtTheConfigurationInForce) {
  const std::filesystem::path cell = dir / "c.toml";
  std::ofstream(cell) << "not read\n";
  let_go = true;
  examiner.begin(cell);
  wait_until_free();
  const Examination before = examiner.newest(), after = Examiner(parts).newest();
  EXPECT_TRUE(after.green());
  EXPECT_FALSE(after.running);
  EXPECT_EQ(after.cell, cell);
  EXPECT_EQ(after.cell_text, before.cell_text);
  EXPECT_EQ(after.ended, "t");
  ASSERT_EQ(after.checks.size(), 2u);
  EXPECT_EQ(after.checks[1].check, "plan");
  EXPECT_EQ(after.checks[1].outcome, Outcome::kWarning);
  EXPECT_EQ(after.checks[1].found, "far");
  EXPECT_EQ(after.checks[1].advice, "widen");
  config = "c2";
  EXPECT_EQ(Examiner(parts).newest().cell, "") << "what was found is of another configuration";
  config = "c1";
  std::ofstream(parts.file) << "{";
  EXPECT_FALSE(Examiner(parts).newest().green());
}

TEST_F(AnExaminer, WarnsOfAnExaminationThatCouldNotBeStored) {
  parts.file = dir / "none" / "doctor.json";
  Examiner other(parts);
  let_go = true;
  other.begin("/c.toml");
  wait_until_free();
  const Examination begun = other.newest();
  EXPECT_TRUE(begun.green());
  EXPECT_EQ(begun.checks.back().check, "doctor");
  EXPECT_EQ(begun.checks.back().outcome, Outcome::kWarning);
  EXPECT_NE(words(begun.checks.back().found).find("not stored: "), std::string::npos);
  const std::filesystem::path cell(CELLCAL_DEMO_CELL);
  ASSERT_FALSE(other.take(cell, calib::sha256(text_of_cell(cell)), "c1", {}));
  EXPECT_EQ(other.newest().count(Outcome::kWarning), 1u);
}

TEST_F(AnExaminer, KeepsWhatWasFoundBeforeWhereItIsStoppedAndWhatIsToldBesideIt) {
  examiner.begin("/c.toml");
  wait_until_running();
  examiner.stop();
  EXPECT_EQ(Examiner(parts).newest().cell, "");
  const std::filesystem::path cell(CELLCAL_DEMO_CELL);
  const std::string sha256 = calib::sha256(text_of_cell(cell));
  Examiner other(parts);
  ASSERT_FALSE(other.take(cell, sha256, "c1", {{"daemon", Outcome::kFailed, "gone", "start it"}}));
  EXPECT_EQ(Examiner(parts).newest().count(Outcome::kFailed), 1u);
  EXPECT_EQ(Examiner(parts).newest().cell, cell);
}

TEST(AFindingInJson, HasItsWordsAndComesBackAsThePhrasesItWasMadeOf) {
  const Finding one{"contact circuit",
                    Outcome::kOk,
                    calib::Phrase("say.doctor.circuit.open", {{"volts", 5.02}}),
                    {}};
  const nlohmann::json english = to_json(one);
  const nlohmann::json german = to_json(one, *calib::Language::of("de"));
  EXPECT_EQ(english.at("found"), "5.02 V, open; wires F, S and E are sound");
  EXPECT_EQ(german.at("found"), "5,02 V, offen; Leitungen F, S und E in Ordnung");
  EXPECT_EQ(finding_of(german).found, one.found);
  nlohmann::json earlier = english;
  earlier.erase("said");
  EXPECT_EQ(words(finding_of(earlier).found), english.at("found"));
  nlohmann::json wrong = english;
  wrong["said"]["found"] = {1};
  EXPECT_THROW(finding_of(wrong), std::invalid_argument);
}

}  // namespace
}  // namespace cellcal::daemon
