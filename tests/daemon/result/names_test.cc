// Names of the daemon's enumerators that files and interfaces have: a renamed enumerator must not change a format.

#include <gtest/gtest.h>

#include <string>

#include "calib/export/corrector.h"
#include "calib/model/enum_table.h"
#include "calib/model/long_work.h"
#include "calib/result/fleet_priors.h"
#include "daemon/certificate/signed_files.h"
#include "daemon/config/config.h"
#include "daemon/controller/advice_publisher.h"
#include "daemon/controller/frame_station.h"
#include "daemon/doctor/steps.h"
#include "daemon/fleet/store.h"
#include "daemon/journal/records.h"
#include "daemon/plant/desk/proposal_box.h"
#include "daemon/plant/line/line_status.h"
#include "daemon/plant/messages/presence.h"
#include "daemon/result/qualification.h"
#include "daemon/service/status.h"
#include "daemon/session/session.h"
#include "daemon/tasks/options.h"
#include "daemon/unattended/notice.h"
#include "daemon/unattended/schedule.h"

namespace cellcal::daemon {
namespace {

/// As to_string() has them; own_name() where there is none.
template <class E, char kBetween = '_'>
std::string names() {
  std::string all;
  for (const E one : all_values<E>()) {
    const std::string name = [&] {
      if constexpr (requires { to_string(one); })
        return to_string(one);
      else
        return own_name<kBetween>(one);
    }();
    all += (all.empty() ? "" : ", ") + name;
    EXPECT_EQ((by_own_name<E, kBetween>(name)), one);
  }
  return all;
}

TEST(NamesOfTheSession, AreThoseOfTheFormats) {
  EXPECT_EQ(
      (names<Phase, ' '>()),
      "idle, planning, connecting, referencing, routing, freeing, proving, transit, arming fast, "
      "fast search, backing off, arming slow, slow search, recording, retreat, choosing, returning, "
      "identifying, reporting, recovering, watching the links, stopping, done, aborted, failed");
  EXPECT_EQ(
      (names<EventKind, ' '>()),
      "run, abort, planned, routed, assessed, identified, reported, work failed, links, device "
      "failed, armed, arm refused, arrived, contact, revoked, stopped, unexpected contact, still in "
      "contact, contact silent, robot silent, refused, not following, recorded, journal sound, "
      "journal failed, deadline");
  EXPECT_EQ(
      (names<FailureKind, '-'>()),
      "plan, not-found, plan-changed, device, link-not-ready, contact-fault, contact-closed, "
      "arm-refused, no-contact, contact-too-early, unexpected-contact, still-in-contact, "
      "readings-disagree, too-many-revoked, contact-silent, computer-busy, robot-silent, "
      "move-refused, not-following, stopped-elsewhere, timeout, stop-unconfirmed, journal, identify, "
      "report, attended, controller-test, window-over, daemon-stopped, unexpected-event");
  EXPECT_EQ(names<drivers::ContactEventKind>(), "trip, contact, revoked, release");
  EXPECT_EQ(names<RecordState>(), "running, interrupted, aborted, failed, done, damaged");
  EXPECT_EQ((names<SessionKind, '-'>()), "calibrate, qualify, check, find, dry-run");
  EXPECT_EQ((names<QualificationFinding, '-'>()),
            "noise-above-stated, overtravel-too-long, delay-not-as-stated, radius-not-as-stated");
  EXPECT_EQ((names<ArmMotion, ' '>()), "unknown, at rest, moving");
  EXPECT_EQ(names<calib::PlanStep>(), "reach, choose, ways");
}

TEST(NamesOfTheSchedule, AreThoseOfTheFormats) {
  EXPECT_EQ((names<Verb, '-'>()),
            "begun, resumed, waiting, refused, missed, stopped, ended, held, released");
  EXPECT_EQ(
      (names<Why, '-'>()),
      "nothing, unattended-off, no-program-start, failed-before, aborted-before, interrupted-before, "
      "past-unknown, busy, no-time-left, outside-window, no-such-time, daemon-not-running, clock-set, "
      "clock-stepped, clock-not-synchronised, clock-agrees, cannot-begin, not-on-disk, done, "
      "harmless, harmful, resumes-used, window-over");
  EXPECT_EQ(
      (names<News, '-'>()),
      "done, withheld, drifted, undecided, recovered, failed, aborted, interrupted, not-begun");
}

TEST(NamesOfThePlant, AreThoseOfTheFormats) {
  EXPECT_EQ(names<plant::SessionState>(), "running, interrupted, aborted, failed, done");
  EXPECT_EQ(names<plant::Held>(), "yes, no, undecided");
  EXPECT_EQ(names<plant::Subject>(), "fact, presence, stored, proposal");
  EXPECT_EQ(names<plant::ProposalKind>(), "calibrate, check, activate, schedule, priors, withdraw");
  EXPECT_EQ(names<plant::Stand>(), "open, accepted, refused, withdrawn");
  EXPECT_EQ(
      (names<plant::LineProblem, '-'>()),
      "none, not-running, files, no-name, unreachable, certificate, login, refused, too-large, "
      "no-collector, taken-over, not-stored, renamed, lost, journal");
  EXPECT_EQ(names<Worth>(), "result, telemetry");
  EXPECT_EQ(names<plant::Worth>(), "result, telemetry");
  EXPECT_EQ((names<plant::DropReason, '-'>()), "no-room, too-large, damaged");
  EXPECT_EQ(names<fleet::Refusal>(), "topic, size, rate, message, bound, database");
}

TEST(NamesOfFilesAndCommands, AreThoseOfTheFormats) {
  EXPECT_EQ(names<calib::ObstacleShape>(), "box, cylinder, mesh");
  EXPECT_EQ(names<BackendKind>(), "rsi, eki, mock");
  EXPECT_EQ((names<SetUpStep, '-'>()),
            "cell, robot, spheres, doctor, qualify, dry-run, first, calibration");
  EXPECT_EQ(names<StepState>(), "todo, done, wrong");
  EXPECT_EQ(names<signing::NotVerified::Why>(),
            "no_signature, damaged_signature, other_key, changed_file, not_listed, missing_file");
  EXPECT_EQ(names<Advice>(),
            "unknown, holds, check_again, let_it_warm_up, re_measure_tcp, recalibrate");
  EXPECT_EQ((names<FrameOutcome, ' '>()), "set, differs, refused, not sent, unknown");
  EXPECT_EQ(names<calib::Unreached>(), "not_a_number, too_far, beyond_limit, near_singularity");
  EXPECT_EQ(
      names<calib::SetAsideKind>(),
      "unreadable, withheld, other_nominal_geometry, inconsistent, uninformative, same_arm, too_far, too_near");
}

}  // namespace
}  // namespace cellcal::daemon
