// Sessions that begin with a closed contact that is at no sphere: the arm holds still.

#include <gtest/gtest.h>

#include "calib/model/kinematics.h"
#include "cells.h"
#include "session.h"
#include "tests/daemon/journal/temporary_directory.h"

namespace cellcal::faults {
namespace {

struct ClosedContact : ::testing::TestWithParam<Wire> {
  /// Shorts the circuit on the way from the first touch to the second one.
  void shorten_in_transit() {
    const calib::JointVector &from = job.plan.touches[0].clear, &to = job.plan.touches[1].standoff;
    const auto off = [&](const calib::JointVector& at) {
      double most = 0.0;
      for (std::size_t i = 0; i < at.size(); ++i)
        most = std::max(most, std::abs(cell->position_rad()[i] - at[i]));
      return most;
    };
    if (journal.touches(session).size() == 1 && off(from) > 0.05 && off(to) > 0.05)
      return cell->short_circuit(true);
    cell->at(cell->now() + std::chrono::milliseconds(4), [this] { shorten_in_transit(); });
  }
  Eigen::Vector3d tip() const {
    const std::vector<double> at = cell->position_rad();
    return arm.nominal_tip_m({at.begin(), at.begin() + std::ssize(job.cell.robot.joints)});
  }

  Job job = make_job(CELLCAL_DEMO_CELL);
  calib::ArmModel arm{job.cell};
  std::unique_ptr<FaultyCell> cell = make_cell(job.cell, {.wire = GetParam()});
  daemon::testing::TemporaryDirectory dir;
  daemon::Journal journal{dir / "j.db"};
  std::int64_t session = journal.begin(job.inputs, "t0");
};

TEST_P(ClosedContact, OnTheWayLetsAResumedSessionMoveNothing) {
  cell->at(cell->power_on() + std::chrono::seconds(1), [this] { shorten_in_transit(); });
  const Ending stopped = run_session(*cell, job, journal, session, false);
  ASSERT_TRUE(stopped.state.failure) << stopped.hung;
  ASSERT_EQ(stopped.state.failure->kind, daemon::FailureKind::kUnexpectedContact)
      << describe(*stopped.state.failure);
  cell->live(std::chrono::seconds(1));
  const Eigen::Vector3d there = tip();
  cell->repair();
  cell->short_circuit(true);
  cell->new_adapters();
  journal.resume(session, "t1");
  const Ending resumed = run_session(*cell, job, journal, session, true);
  ASSERT_TRUE(resumed.state.failure) << resumed.hung;
  EXPECT_EQ(resumed.state.failure->kind, daemon::FailureKind::kPlan)
      << describe(*resumed.state.failure);
  EXPECT_LT((tip() - there).norm(), 1e-3);
}

INSTANTIATE_TEST_SUITE_P(Wires, ClosedContact,
                         ::testing::Values(Wire::kRsi, Wire::kRsiInput, Wire::kEkiInput),
                         [](const auto& wire) {
                           std::string name = to_string(wire.param);
                           std::erase(name, '-');
                           return name;
                         });

}  // namespace
}  // namespace cellcal::faults
