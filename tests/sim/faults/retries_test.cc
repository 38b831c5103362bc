// Sessions that may continue by themselves, on the emulated cell: after harmless interruptions
// only. The matrix compares each touch with the truth, and checks the last motion of the arm.

#include <gtest/gtest.h>

#include <cstdlib>

#include "matrix.h"

namespace cellcal::faults {
namespace {

using std::chrono::milliseconds;

class SessionRetries : public ::testing::Test {
 protected:
  SessionRetries() : folder_(make_folder()) {}
  ~SessionRetries() override {
    std::error_code nothing_to_be_done;
    std::filesystem::remove_all(folder_, nothing_to_be_done);
  }

  Matrix matrix(int retries) const {
    Expectation expectation;
    expectation.retries = retries;
    return matrix(expectation);
  }
  Matrix matrix(const Expectation& expectation) const {
    return Matrix(CELLCAL_DEMO_CELL, folder_, 1, expectation);
  }
  static const Stretch& stretch(const Reference& reference, TouchPhase phase) {
    for (const Stretch& one : reference.stretches) {
      if (one.phase == phase) return one;
    }
    throw std::logic_error("no such stretch");
  }
  static Fault book(std::function<void(const Victim&)> act) {
    Fault fault{"drop", "test", "test"};
    fault.book = std::move(act);
    return fault;
  }
  /// Pauses of 20 ms without a packet, far enough apart to occur individually.
  static Fault pauses(int count) {
    return book([count](const Victim& victim) {
      for (int i = 0; i < count; ++i) {
        const TimePoint at = victim.at + i * milliseconds(4500);
        victim.cell.to_pc().add({sim::LineFaultKind::kDrop, at, at + milliseconds(20)});
      }
    });
  }
  /// Intervals of 60 ms in which this computer delays the sensor's bytes.
  static Fault late_bytes(int count, milliseconds apart = milliseconds(4500)) {
    return book([=](const Victim& victim) {
      for (int i = 0; i < count; ++i) {
        const TimePoint at = victim.at + i * apart + milliseconds(i * i * 713 % 900);
        victim.cell.serial().to_host().add(
            {sim::LineFaultKind::kDelay, at, at + milliseconds(30), 1.0, -1, milliseconds(60)});
      }
    });
  }
  /// Every second its bytes are 100 to 300 ms late, for 0.2 s: 100, 200, 300, 100, ...
  static Fault later_and_later(int count) {
    return book([=](const Victim& victim) {
      for (int i = 0; i < count; ++i) {
        const TimePoint at = victim.at + i * milliseconds(1130);
        victim.cell.serial().to_host().add({sim::LineFaultKind::kDelay, at, at + milliseconds(200),
                                            1.0, -1, milliseconds(100 * (1 + i % 3))});
      }
    });
  }
  static Fault late_replies() {
    return book([](const Victim& victim) {
      victim.cell.to_krc().add(
          {sim::LineFaultKind::kDrop, victim.at, victim.at + milliseconds(1500), 1.0, 4});
    });
  }

 private:
  static std::string make_folder() {
    std::string name = std::filesystem::temp_directory_path() / "cellcal-retries-XXXXXX";
    if (mkdtemp(name.data()) == nullptr) throw std::runtime_error("cannot create " + name);
    return name;
  }
  std::filesystem::path folder_;
};

constexpr TouchPhase kMoving[] = {TouchPhase::kTransit, TouchPhase::kApproach, TouchPhase::kSearch,
                                  TouchPhase::kLatch, TouchPhase::kRetreat};

std::string shown(const Verdict& verdict) {
  return verdict.name + ": " + verdict.words + ::testing::PrintToString(verdict.violations);
}

TEST_F(SessionRetries, FinishInOneGoBehind20MsWithoutAPacket) {
  Matrix one = matrix(2);
  for (const TouchPhase phase : kMoving) {
    const Verdict verdict =
        one.run(Wire::kRsi, pauses(1), stretch(one.reference(Wire::kRsi), phase), 1);
    EXPECT_EQ(verdict.outcome, Outcome::kMeasured) << to_string(phase) << ": " << shown(verdict);
    EXPECT_EQ(verdict.interruptions, 1) << to_string(phase);
  }
}

TEST_F(SessionRetries, EndAsEverWhereNobodyAllowedIt) {
  Matrix one = matrix(0);
  const Verdict verdict =
      one.run(Wire::kRsi, pauses(1), stretch(one.reference(Wire::kRsi), TouchPhase::kTransit), 1);
  EXPECT_EQ(verdict.outcome, Outcome::kNamed) << shown(verdict);
  EXPECT_EQ(verdict.name, "robot-silent");
  EXPECT_EQ(verdict.interruptions, 0);
}

class BusyComputer : public SessionRetries, public ::testing::WithParamInterface<Wire> {};
INSTANTIATE_TEST_SUITE_P(Over, BusyComputer,
                         ::testing::Values(Wire::kRsi, Wire::kEkiInput, Wire::kEkiFlag),
                         [](const auto& one) {
                           return one.param == Wire::kRsi        ? "rsi"
                                  : one.param == Wire::kEkiInput ? "eki_by_its_input"
                                                                 : "eki_by_a_flag";
                         });

TEST_P(BusyComputer, SessionsFinishInOneGoByDefault) {
  Matrix one = matrix(0);
  // Idle heartbeats arrive every 100 ms, so that 60 ms more stop only a search.
  for (const TouchPhase phase : {TouchPhase::kSearch, TouchPhase::kApproach}) {
    const Verdict verdict =
        one.run(GetParam(), late_bytes(1), stretch(one.reference(GetParam()), phase), 1);
    EXPECT_EQ(verdict.outcome, Outcome::kMeasured) << to_string(phase) << ": " << shown(verdict);
    if (phase == TouchPhase::kSearch) {
      EXPECT_EQ(verdict.interruptions, 1);
    }
  }
}

TEST_P(BusyComputer, AgainAndAgainTheyFinishAllTheSame) {
  Matrix one = matrix(0);
  // A touch over EKI takes some seconds; the instants are never synchronous with periodic events.
  const milliseconds apart{GetParam() == Wire::kRsi ? 3700 : 17000};
  const Verdict verdict = one.run(GetParam(), late_bytes(40, apart),
                                  stretch(one.reference(GetParam()), TouchPhase::kSearch), 1);
  EXPECT_EQ(verdict.outcome, Outcome::kMeasured) << shown(verdict);
  EXPECT_GE(verdict.interruptions, 1);
}

TEST_P(BusyComputer, AndTheSensorFellSilentTheyEnd) {
  Matrix one = matrix(0);
  Fault fault = book([](const Victim& victim) {
    victim.cell.serial().to_host().add({sim::LineFaultKind::kDelay, victim.at,
                                        victim.at + milliseconds(30), 1.0, -1, milliseconds(60)});
    victim.cell.serial().to_host().add(
        {sim::LineFaultKind::kCut, victim.at + milliseconds(30), TimePoint::max()});
  });
  fault.silences = Silent::kSensor;
  const Verdict verdict =
      one.run(GetParam(), fault, stretch(one.reference(GetParam()), TouchPhase::kSearch), 1);
  EXPECT_EQ(verdict.outcome, Outcome::kNamed) << shown(verdict);
}

class SecondStopPath : public SessionRetries {
 protected:
  Verdict run(Wire wire, const Fault& fault, TouchPhase phase = TouchPhase::kSearch) {
    Expectation expectation;
    expectation.check_phase = false;
    Matrix one = matrix(expectation);
    return one.run(wire, fault, stretch(one.reference(wire), phase), 1);
  }
};

TEST_F(SecondStopPath, LateBytesPauseNoSession) {
  const Verdict without = run(Wire::kRsi, later_and_later(40));
  EXPECT_EQ(without.outcome, Outcome::kMeasured) << shown(without);
  EXPECT_GE(without.interruptions, 1);
  const Verdict with = run(Wire::kRsiInput, later_and_later(40));
  EXPECT_EQ(with.outcome, Outcome::kMeasured) << shown(with);
  EXPECT_EQ(with.interruptions, 0);
}

TEST_F(SecondStopPath, LateBytesPauseNoSessionInAnyPhase) {
  for (const TouchPhase phase : {TouchPhase::kTransit, TouchPhase::kApproach, TouchPhase::kSearch,
                                 TouchPhase::kContact, TouchPhase::kLatch, TouchPhase::kRetreat}) {
    for (const int late_ms : {100, 300, 500}) {
      const Fault late = book([=](const Victim& victim) {
        victim.cell.serial().to_host().add({sim::LineFaultKind::kDelay, victim.at,
                                            victim.at + milliseconds(100), 1.0, -1,
                                            milliseconds(late_ms)});
      });
      const Verdict verdict = run(Wire::kRsiInput, late, phase);
      EXPECT_EQ(verdict.outcome, Outcome::kMeasured) << to_string(phase) << ": " << shown(verdict);
      EXPECT_EQ(verdict.interruptions, 0) << to_string(phase) << ", " << late_ms << " ms";
    }
  }
}

TEST_F(SecondStopPath, AContactWhoseBytesAreLostIsMeasuredByItsRepetition) {
  const Fault lost = book([](const Victim& victim) {
    victim.cell.serial().to_host().add(
        {sim::LineFaultKind::kDrop, victim.at - milliseconds(5), victim.at + milliseconds(300)});
  });
  const Verdict verdict = run(Wire::kRsiInput, lost, TouchPhase::kContact);
  EXPECT_EQ(verdict.outcome, Outcome::kMeasured) << shown(verdict);
  EXPECT_EQ(verdict.interruptions, 0);
}

TEST_F(SecondStopPath, BytesThatAreLaterThanItsLimitPauseItAllTheSame) {
  const Fault late = book([](const Victim& victim) {
    victim.cell.serial().to_host().add({sim::LineFaultKind::kDelay, victim.at,
                                        victim.at + milliseconds(100), 1.0, -1, milliseconds(900)});
  });
  const Verdict verdict = run(Wire::kRsiInput, late);
  EXPECT_EQ(verdict.outcome, Outcome::kMeasured) << shown(verdict);
  EXPECT_EQ(verdict.interruptions, 1);
}

TEST_F(SecondStopPath, ASessionWhoseInputIsStuckGoesOnByTheBytes) {
  const Fault stuck = book([](const Victim& victim) {
    victim.cell.at(victim.at, [&cell = victim.cell] { cell.input_stuck_on(true); });
  });
  const Verdict verdict = run(Wire::kRsiInput, stuck);
  EXPECT_EQ(verdict.outcome, Outcome::kMeasured) << shown(verdict);
  EXPECT_EQ(verdict.interruptions, 0);
}

TEST_F(SecondStopPath, ASessionWhoseInputIsCutEndsByThatName) {
  Fault cut = book([](const Victim& victim) {
    victim.cell.at(victim.at, [&cell = victim.cell] { cell.input_wire(true); });
  });
  cut.silences = Silent::kHand;
  for (const TouchPhase phase : {TouchPhase::kTransit, TouchPhase::kSearch, TouchPhase::kLatch}) {
    const Verdict verdict = run(Wire::kRsiInput, cut, phase);
    EXPECT_EQ(verdict.outcome, Outcome::kNamed) << to_string(phase) << ": " << shown(verdict);
    EXPECT_NE(verdict.words.find("contact input"), std::string::npos) << shown(verdict);
  }
}

TEST_F(SessionRetries, EndByTheComputersNameWhereNoRepeatIsAllowed) {
  Expectation expectation;
  expectation.repeats = {0, 0};
  Matrix one = matrix(expectation);
  for (const Fault& fault : {late_bytes(1), late_replies()}) {
    const Verdict verdict =
        one.run(Wire::kRsi, fault, stretch(one.reference(Wire::kRsi), TouchPhase::kSearch), 1);
    EXPECT_EQ(verdict.outcome, Outcome::kNamed) << shown(verdict);
    // Bytes that have not arrived by then give no information: only the sensor's silence is known.
    EXPECT_TRUE(verdict.name == "computer-busy") << shown(verdict);
    EXPECT_EQ(verdict.interruptions, 0);
  }
}

TEST_F(SessionRetries, FinishInOneGoBehindLateRepliesByDefault) {
  Matrix one = matrix(0);
  for (const TouchPhase phase : {TouchPhase::kTransit, TouchPhase::kSearch}) {
    const Verdict verdict =
        one.run(Wire::kRsi, late_replies(), stretch(one.reference(Wire::kRsi), phase), 1);
    EXPECT_EQ(verdict.outcome, Outcome::kMeasured) << to_string(phase) << ": " << shown(verdict);
    EXPECT_EQ(verdict.interruptions, 1) << to_string(phase);
  }
}

TEST_F(SessionRetries, EndAtTheInterruptionBehindTheLastThatWasAllowed) {
  Matrix one = matrix(2);
  const Verdict verdict =
      one.run(Wire::kRsi, pauses(3), stretch(one.reference(Wire::kRsi), TouchPhase::kTransit), 1);
  EXPECT_EQ(verdict.outcome, Outcome::kNamed) << shown(verdict);
  EXPECT_EQ(verdict.name, "robot-silent");
  EXPECT_EQ(verdict.interruptions, 2);
  EXPECT_NE(verdict.words.find("automatic retries are used ([session] retries)"), std::string::npos)
      << verdict.words;
}

TEST_F(SessionRetries, NeverGoOnFromWhatSomebodyHasToLookAt) {
  struct Case {
    const char* what;
    Silent by;
    int tries;  ///< maximum: an apparent pause is waited for without result
    std::function<void(FaultyCell&)> act;
  };
  const Case cases[] = {
      {"emergency stop", Silent::kRobot, 0, [](FaultyCell& cell) { cell.operator_stops(); }},
      {"emergency stop, and a pause with it", Silent::kRobot, 2,
       [](FaultyCell& cell) {
         cell.operator_stops();
         cell.to_pc().add({sim::LineFaultKind::kDrop, cell.now(), cell.now() + milliseconds(20)});
       }},
      {"power off", Silent::kRobot, 1, [](FaultyCell& cell) { cell.power_off(true); }},
      {"cable pulled", Silent::kRobot, 1,
       [](FaultyCell& cell) {
         cell.to_pc().add({sim::LineFaultKind::kCut, cell.now(), TimePoint::max()});
         cell.to_krc().add({sim::LineFaultKind::kCut, cell.now(), TimePoint::max()});
       }},
      {"cable pulled for a second", Silent::kRobot, 1,
       [](FaultyCell& cell) {
         const TimePoint end = cell.now() + milliseconds(1000);
         cell.to_pc().add({sim::LineFaultKind::kCut, cell.now(), end});
         cell.to_krc().add({sim::LineFaultKind::kCut, cell.now(), end});
       }},
      {"short circuit", Silent::kHand, 0, [](FaultyCell& cell) { cell.short_circuit(true); }},
      {"sensor's cable", Silent::kSensor, 0,
       [](FaultyCell& cell) {
         cell.serial().to_host().add({sim::LineFaultKind::kCut, cell.now(), TimePoint::max()});
       }},
      {"stopped by another party", Silent::kHand, 0, [](FaultyCell& cell) { cell.robot().stop(); }},
  };
  Matrix one = matrix(100);
  for (const Case& what : cases) {
    Fault fault = book([&](const Victim& victim) {
      victim.cell.at(victim.at, [&cell = victim.cell, &what] { what.act(cell); });
    });
    fault.silences = what.by;
    const Verdict verdict =
        one.run(Wire::kRsi, fault, stretch(one.reference(Wire::kRsi), TouchPhase::kTransit), 1);
    EXPECT_EQ(verdict.outcome, Outcome::kNamed) << what.what << ": " << shown(verdict);
    EXPECT_LE(verdict.interruptions, what.tries) << what.what << ": " << shown(verdict);
  }
}

TEST_F(SessionRetries, OverEkiEndAsEver) {
  Matrix one = matrix(100);
  const Fault cut = book([](const Victim& victim) {
    for (sim::Line* line : {&victim.cell.to_pc(), &victim.cell.to_krc()})
      line->add({sim::LineFaultKind::kCut, victim.at, victim.at + milliseconds(400)});
  });
  const Verdict verdict = one.run(Wire::kEkiInput, cut,
                                  stretch(one.reference(Wire::kEkiInput), TouchPhase::kTransit), 1);
  EXPECT_EQ(verdict.outcome, Outcome::kNamed) << shown(verdict);
  EXPECT_EQ(verdict.interruptions, 0);
}

}  // namespace
}  // namespace cellcal::faults
