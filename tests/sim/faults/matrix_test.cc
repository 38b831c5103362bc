// Sensitivity of the matrix: a correct run passes; the same run fails against false requirements.

#include "matrix.h"

#include <gtest/gtest.h>

#include <cstdlib>

namespace cellcal::faults {
namespace {

class FaultMatrixJudgement : public ::testing::TestWithParam<Wire> {
 protected:
  FaultMatrixJudgement() : folder_(make_folder()) {}
  ~FaultMatrixJudgement() override {
    std::error_code nothing_to_be_done;
    std::filesystem::remove_all(folder_, nothing_to_be_done);
  }

  Matrix matrix(const Expectation& expectation = {}, std::uint64_t seed = 1) const {
    return Matrix(CELLCAL_DEMO_CELL, folder_, seed, expectation);
  }
  static const Stretch& stretch(const Reference& reference, TouchPhase phase,
                                std::string_view which) {
    for (const Stretch& one : reference.stretches) {
      if (one.phase == phase && one.which == which) return one;
    }
    throw std::logic_error("no such stretch");
  }
  /// The fault at the slow search's own instant.
  Verdict at_slow(Matrix& matrix, TouchPhase phase, const Fault& fault) const {
    return matrix.run(GetParam(), fault, stretch(matrix.reference(GetParam()), phase, "slow"), 1);
  }
  static Fault book(const char* variant, std::function<void(const Victim&)> act) {
    Fault fault{"drop", variant, "test"};
    fault.book = std::move(act);
    return fault;
  }

 private:
  static std::filesystem::path make_folder() {
    std::string name = std::filesystem::temp_directory_path() / "cellcal-matrix-XXXXXX";
    if (mkdtemp(name.data()) == nullptr) throw std::runtime_error("cannot create " + name);
    return name;
  }
  std::filesystem::path folder_;
};

const Fault kNothing{"drop", "nothing at all", "nowhere"};

bool speaks_of(const Verdict& verdict, const std::string& what) {
  for (const std::string& one : verdict.violations) {
    if (one.find(what) != std::string::npos) return true;
  }
  return false;
}

TEST_P(FaultMatrixJudgement, MeasuresRightWithoutAFault) {
  Matrix one = matrix();
  const Verdict verdict = at_slow(one, TouchPhase::kSearch, kNothing);
  EXPECT_EQ(verdict.outcome, Outcome::kMeasured) << ::testing::PrintToString(verdict.violations);
  EXPECT_LT(verdict.worst_m, 0.03e-3);
  EXPECT_GT(verdict.worst_m, 0.0) << "nothing measures to the last bit";
}

TEST_P(FaultMatrixJudgement, NoticesTouchesThatAreNotWhereTheTruthIs) {
  Matrix one = matrix({.truth_off_m = 0.06e-3});
  const Verdict verdict = at_slow(one, TouchPhase::kSearch, kNothing);
  EXPECT_EQ(verdict.outcome, Outcome::kViolation);
  EXPECT_TRUE(speaks_of(verdict, "from where the tip truly met"));
}

TEST_P(FaultMatrixJudgement, NoticesATouchThatTheTruthLeftBehind) {
  // The contact is detected late: the sensor's edges are hidden for 20 ms, and no error is
  // reported.
  Matrix one = matrix();
  const Fault late = book("edges 20 ms late", [](const Victim& victim) {
    victim.cell.at(victim.cell.power_on(),
                   [&cell = victim.cell] { cell.delay_edges(std::chrono::milliseconds(20)); });
  });
  const Verdict verdict = at_slow(one, TouchPhase::kSearch, late);
  EXPECT_TRUE(speaks_of(verdict, "from where the tip truly met"))
      << ::testing::PrintToString(verdict.violations);
}

TEST_P(FaultMatrixJudgement, NoticesAnArmThatDoesNotRest) {
  Matrix one = matrix({.search_ramp_s = -1.0});
  Fault unplugged = book("serial cable", [](const Victim& victim) {
    victim.cell.serial().to_host().add({sim::LineFaultKind::kCut, victim.at, TimePoint::max()});
  });
  unplugged.silences = Silent::kRobot;
  const Verdict verdict = at_slow(one, TouchPhase::kSearch, unplugged);
  EXPECT_TRUE(speaks_of(verdict, "the arm moves")) << ::testing::PrintToString(verdict.violations);
}

TEST_P(FaultMatrixJudgement, NoticesAnArmThatSomebodyElseMovesBehindTheError) {
  // The fault is over, the session has failed, and the arm is moved nevertheless.
  Matrix one = matrix();
  const Fault driven = book("stopped, and moved again", [](const Victim& victim) {
    FaultyCell& cell = victim.cell;
    cell.at(victim.at, [&cell] { cell.robot().stop(); });
    cell.at(victim.at + std::chrono::seconds(2), [&cell] { cell.shake(); });
  });
  const Verdict verdict = at_slow(one, TouchPhase::kSearch, driven);
  EXPECT_TRUE(speaks_of(verdict, "the arm moves")) << ::testing::PrintToString(verdict.violations);
}

TEST_P(FaultMatrixJudgement, NoticesAnEndThatNobodyAskedFor) {
  Matrix one = matrix();
  Fault abort = book("abort", [](const Victim& victim) {
    victim.cell.at(victim.at, [runner = victim.runner] { runner->request_abort(); });
  });
  Verdict verdict = at_slow(one, TouchPhase::kSearch, abort);
  EXPECT_TRUE(speaks_of(verdict, "nobody asked for it"));
  abort.asks_for_end = true;
  verdict = at_slow(one, TouchPhase::kSearch, abort);
  EXPECT_EQ(verdict.outcome, Outcome::kNamed) << ::testing::PrintToString(verdict.violations);
}

TEST_P(FaultMatrixJudgement, NoticesAFaultThatComesInAnotherPhase) {
  Matrix one = matrix();
  Stretch wrong = stretch(one.reference(GetParam()), TouchPhase::kSearch, "slow");
  wrong.phase = TouchPhase::kTransit;
  const Verdict verdict = one.run(GetParam(), kNothing, wrong, 1);
  EXPECT_TRUE(speaks_of(verdict, "was to come in transit, and came while 'slow search'"));
}

TEST_P(FaultMatrixJudgement, GivesTheSameVerdictsAgain) {
  std::vector<double> worst[2];
  for (auto& one : worst) {
    Matrix again = matrix({}, 5);
    const std::vector<Fault> faults = faults_of(GetParam());
    for (std::size_t i = 0; i < faults.size(); i += 9) {
      const Verdict verdict = at_slow(again, TouchPhase::kLatch, faults[i]);
      one.push_back(verdict.worst_m);
      one.push_back(verdict.rest_s);
    }
  }
  EXPECT_EQ(worst[0], worst[1]);
}

INSTANTIATE_TEST_SUITE_P(Wires, FaultMatrixJudgement,
                         ::testing::Values(Wire::kRsi, Wire::kRsiInput, Wire::kRsi6,
                                           Wire::kEkiInput, Wire::kEkiFlag),
                         [](const auto& one) {
                           return one.param == Wire::kRsi        ? "rsi"
                                  : one.param == Wire::kRsiInput ? "rsi_input"
                                  : one.param == Wire::kRsi6     ? "rsi6"
                                  : one.param == Wire::kEkiInput ? "eki"
                                                                 : "eki_flag";
                         });

}  // namespace
}  // namespace cellcal::faults
