// Starting of CELLCAL_EKI, its behaviour under CELL, and requests of the controller.

#include "tests/drivers/kuka/eki/eki_rig.h"

namespace cellcal::drivers {
namespace {

sim::EkiControllerConfig permitting(bool may_run) {
  sim::EkiControllerConfig config = eki_controller();
  EkiFilesConfig files;
  files.may_run = may_run;
  config.files = eki_files(files);
  return config;
}
EkiConfig asking(bool asks) {
  EkiConfig config = eki_config();
  config.run_program = asks;
  return config;
}

/// In the evening: no program is selected, and the mode is EXT, or another one.
struct UnattendedStart : EkiRig {
  explicit UnattendedStart(bool may_run = true, bool asks = true,
                           OperatingMode mode = OperatingMode::kExt)
      : EkiRig(permitting(may_run), asking(asks)) {
    krc.cancel_program();
    krc.mode(mode);
    run(40ms);
    EXPECT_TRUE(connect());
  }
  bool starts() {
    return run_until([&] { return krc.ready(); }, 6s);
  }
  bool asked() const { return written.find(" Type=\"6\"") != std::string::npos; }
};

TEST(CellcalEki, IsStartedInExtWhereItIsAskedForAndPermitted) {
  UnattendedStart rig;
  EXPECT_TRUE(rig.starts()) << rig.words();
  rig.reference();
  EXPECT_EQ(rig.move(MoveKind::kTransit, rig.moved_by(0, 2.0)).outcome, MoveOutcome::kArrived);
}

TEST(CellcalEki, IsNotStartedWithoutPermissionNorUnasked) {
  UnattendedStart forbidden(false);
  EXPECT_FALSE(forbidden.starts());
  EXPECT_TRUE(forbidden.asked());
  UnattendedStart unasked(true, false);
  EXPECT_FALSE(unasked.starts());
  EXPECT_FALSE(unasked.asked());
}

TEST(CellcalEki, IsNeitherAskedForNorStartedInAnotherMode) {
  for (const OperatingMode mode : {OperatingMode::kT1, OperatingMode::kT2, OperatingMode::kAut}) {
    UnattendedStart rig(true, true, mode);
    EXPECT_FALSE(rig.starts());
    EXPECT_FALSE(rig.asked());
  }
}

TEST(CellcalEki, IsNotAskedForWithDrivesOffOrAStopMessage) {
  EkiRig rig(permitting(true), asking(true));
  rig.krc.cancel_program();
  rig.krc.mode(OperatingMode::kExt);
  rig.krc.emergency_stop(true);
  rig.run(40ms);
  ASSERT_TRUE(rig.connect());
  rig.run(6s);
  EXPECT_EQ(rig.written.find(" Type=\"6\""), std::string::npos);
  rig.krc.emergency_stop(false);  // the message stays until it is acknowledged
  rig.run(6s);
  EXPECT_FALSE(rig.krc.ready());
}

TEST(CellcalEki, IsNotStartedInPlaceOfAnotherProgram) {
  UnattendedStart rig;
  rig.krc.start_other_program();
  rig.run(6s);
  EXPECT_TRUE(rig.asked());
  EXPECT_FALSE(rig.krc.program_runs());
}

TEST(CellcalEki, ReturnsWithItsSessionAndIsStartedAgainForTheNext) {
  UnattendedStart rig;
  ASSERT_TRUE(rig.starts());
  rig.close_connection();
  rig.run(200ms);
  EXPECT_FALSE(rig.krc.program_runs());
  ASSERT_TRUE(rig.connect());
  EXPECT_TRUE(rig.starts());
}

/// Called by CELL.SRC.
struct UnderCell : EkiRig {
  explicit UnderCell(sim::EkiControllerConfig config = eki_controller())
      : EkiRig(std::move(config)) {
    krc.cancel_program();
    krc.mode(OperatingMode::kExt);
    krc.start_other_program();
    krc.call_program();
    run(40ms);
  }
};

TEST(CellcalEki, IsReadyUnderCellAndMoves) {
  UnderCell rig;
  rig.make_ready();
  EXPECT_EQ(rig.move(MoveKind::kTransit, rig.moved_by(0, 2.0)).outcome, MoveOutcome::kArrived);
  EXPECT_TRUE(rig.krc.program_runs());
}

TEST(CellcalEki, ReturnsToCellWhenItsSessionSaysBye) {
  UnderCell rig;
  rig.make_ready();
  rig.core.close();
  ASSERT_TRUE(rig.run_until([&] { return rig.core.ended(); }, 2s));
  rig.run(100ms);
  EXPECT_FALSE(rig.krc.program_runs());
}

TEST(CellcalEki, BrakesAndReturnsToCellWhereTheConnectionIsLostInMidMove) {
  UnderCell rig;
  rig.make_ready();
  rig.core.begin({1, MoveKind::kTransit, rig.moved_by(0, 60.0), 0.0, 0});
  rig.run(300ms);
  ASSERT_FALSE(rig.krc.at_rest());
  rig.cable = false;
  rig.krc.disconnect();
  EXPECT_TRUE(rig.run_until([&] { return rig.krc.at_rest(); }, 2s));
  rig.run(300ms);  // the arm comes to rest after its setpoint
  const double at = rig.true_deg();
  EXPECT_LT(at, 59.0);
  rig.run(1s);
  EXPECT_FALSE(rig.krc.program_runs());
  EXPECT_NEAR(rig.true_deg(), at, 1e-4);
}

TEST(CellcalEki, ReturnsToCellWhereNoSessionComes) {
  sim::EkiControllerConfig config = eki_controller();
  EkiFilesConfig files;
  files.cell_wait_s = 10;
  config.files = eki_files(files);
  UnderCell rig(config);
  rig.run(9s);
  EXPECT_TRUE(rig.krc.program_runs());
  rig.run(2s);
  EXPECT_FALSE(rig.krc.program_runs());
}

TEST(CellcalEki, StaysWhereAPersonHasStartedIt) {
  EkiRig rig;
  rig.make_ready();
  rig.core.close();
  ASSERT_TRUE(rig.run_until([&] { return rig.core.ended(); }, 2s));
  rig.run(1s);
  EXPECT_TRUE(rig.krc.program_runs());
}

TEST(ControllerRequests, IsToldWithWhatToDo) {
  sim::EkiControllerConfig config = eki_controller();
  EkiFilesConfig files;
  files.brake_test_output = 101;
  files.mastering_test_output = 102;
  files.collision_output = 103;
  config.files = eki_files(files);
  EkiRig rig(config);
  rig.make_ready();
  EXPECT_EQ(rig.core.state().request, ControllerRequest::kNone);
  EXPECT_EQ(rig.words(), "");
  for (const auto& [asked, request, words] :
       {std::tuple{ControllerRequest::kBrakeTest, ControllerRequest::kBrakeTest,
                   "brake test requested"},
        std::tuple{ControllerRequest::kMasteringTest, ControllerRequest::kMasteringTest,
                   "mastering test requested"},
        std::tuple{ControllerRequest::kCollision, ControllerRequest::kCollision,
                   "collision detected"}}) {
    rig.krc.request(asked);
    rig.run(100ms);
    EXPECT_EQ(rig.core.state().request, request);
    EXPECT_NE(rig.words().find(words), std::string::npos) << rig.words();
    EXPECT_EQ(rig.link(), RobotLink::kReady) << "it can be moved for some time yet";
  }
  rig.close_connection();
  EXPECT_EQ(rig.core.state().request, ControllerRequest::kNone) << "not known any more";
}

}  // namespace
}  // namespace cellcal::drivers
