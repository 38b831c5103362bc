// Interrupted searches, and the retreat from them.

#include <gtest/gtest.h>

#include <cstdio>
#include <limits>

#include "calib/model/error.h"
#include "calib/plan/touch_sequence.h"
#include "sim/cell/truth.h"
#include "tests/calib/plan/find_drive.h"
#include "tests/calib/plan/ways.h"
#include "tests/calib/simulate.h"

namespace cellcal::calib {
namespace {

const SearchUnderWay kLeft{
    "S1", {{0.0, 0.0}, {0.5, 0.0}, {1.0, 0.0}}, {1.0, 0.4}, {{1.1, -0.2}, {3.0, 3.0}}};

TEST(SearchRetreat, LeadsFromAnywhereOnItToTheClearPointAndOut) {
  for (const JointVector& at : {JointVector{1.0, 0.0}, JointVector{1.0, 0.3}, JointVector{1.0, 0.4},
                                JointVector{1.05, -0.1}, JointVector{1.0, 0.3 + kOnWayRad / 2}})
    EXPECT_EQ(way_out_of(kLeft, at, false), kLeft.out) << at[0] << " " << at[1];
}

TEST(SearchRetreat, GoesOnToItFromTheWayThere) {
  EXPECT_EQ(way_out_of(kLeft, {0.6, 0.0}, false),
            (std::vector<JointVector>{{1.0, 0.0}, {1.1, -0.2}, {3.0, 3.0}}));
  EXPECT_EQ(way_out_of(kLeft, {0.0, 0.0}, false),
            (std::vector<JointVector>{{0.5, 0.0}, {1.0, 0.0}, {1.1, -0.2}, {3.0, 3.0}}));
}

TEST(SearchRetreat, LeadsOutOfAContactAlongTheSearchAlone) {
  EXPECT_EQ(way_out_of(kLeft, {1.0, 0.3}, true), kLeft.out);
  EXPECT_EQ(way_out_of(kLeft, {1.05, -0.1}, true), kLeft.out);
  EXPECT_FALSE(way_out_of(kLeft, {0.6, 0.0}, true)) << "the way leads on to the search";
}

TEST(SearchRetreat, GoesOnWhereTheArmWasOnItsWayHome) {
  const SearchUnderWay home{"", {{0.0, 0.0}, {0.5, 0.0}, {1.0, 0.0}}, {}, {}};
  EXPECT_EQ(way_out_of(home, {0.6, 0.0}, false), (std::vector<JointVector>{{1.0, 0.0}}));
}

TEST(SearchRetreat, IsNoneWhereTheArmIsElsewhereOrNoWayIsKnown) {
  EXPECT_FALSE(way_out_of(kLeft, {1.0 - 2.0 * kOnWayRad, 0.3}, false)) << "jogged aside";
  EXPECT_FALSE(way_out_of(kLeft, {1.0, 0.4 + 2.0 * kOnWayRad}, false)) << "jogged on";
  EXPECT_FALSE(way_out_of(kLeft, {0.25, 0.1}, false));
  EXPECT_FALSE(way_out_of(kLeft, {1.0}, false)) << "another arm";
  EXPECT_FALSE(way_out_of(kLeft, {1.0, std::numeric_limits<double>::quiet_NaN()}, false));
  SearchUnderWay none = kLeft;
  none.out.clear();
  EXPECT_FALSE(way_out_of(none, {1.0, 0.3}, false));
  EXPECT_FALSE(way_out_of({}, {1.0, 0.3}, false));
}

/// Another session with the same cell file: the moves to its first search; empty if refused.
std::vector<JointVector> begun_anew(const Cell& cell, std::optional<SearchUnderWay> left,
                                    const JointVector& from) {
  TouchSequenceOptions options;
  options.only_find = options.find = true;
  options.left = std::move(left);
  TouchSequence sequence(cell, options, {});
  try {
    return sequence.next(from, false)->transit;
  } catch (const PlanError& error) {
    EXPECT_EQ(error.kind, PlanError::Kind::kArmStands) << error.what();
    return {};
  }
}

TEST(AbandonedSearch, IsLeftByTheNextSessionAndNoSphereIsMetOnTheWay) {
  const Cell table = testing::table_cell(0.04, 0.0, 0);
  int left = 0, refused_before = 0;
  for (unsigned seed = 1; seed <= 2; ++seed) {
    const sim::Truth truth = testing::plain_truth(table, seed);
    const Cell cell = testing::as_rough_as_stated(table, 0.005, seed);
    TouchSequenceOptions options;
    options.only_find = options.find = true;
    TouchSequence first(cell, options, {});
    JointVector at(6, 0.0);
    at[1] = -1.2, at[2] = 1.6, at[4] = 1.0;
    for (int k = 0; k < 9; ++k) {
      const auto line = first.next(at, false);
      ASSERT_TRUE(line);
      const auto under_way = first.under_way(at, line);
      ASSERT_TRUE(under_way);
      EXPECT_EQ(under_way->target, line->target);
      const auto touch = testing::search(cell, truth, *line);
      const JointVector deepest = touch ? touch->joint_rad : line->end;
      for (const double share : {0.0, 0.5, 0.9}) {
        const JointVector stands = testing::between(line->standoff, deepest, share);
        if (!begun_anew(cell, std::nullopt, stands).empty()) continue;
        ++refused_before;
        const std::vector<JointVector> way = begun_anew(cell, under_way, stands);
        ASSERT_FALSE(way.empty()) << "seed " << seed << ", line " << k;
        ++left;
        EXPECT_EQ(way.front(), line->clear);
        testing::SphereGaps gaps;
        testing::record_gaps(cell, truth, stands, way.front(), cell.target_index(line->target),
                             gaps);
        for (std::size_t i = 0; i + 1 < way.size(); ++i)
          testing::record_gaps(cell, truth, way[i], way[i + 1], std::nullopt, gaps);
        EXPECT_GT(gaps.tip_m, 0.003) << "seed " << seed << ", line " << k;
        EXPECT_GT(gaps.shaft_m, 0.0) << "seed " << seed << ", line " << k;
        JointVector jogged = stands;
        jogged[0] += 3.0 * kOnWayRad;
        EXPECT_EQ(begun_anew(cell, under_way, jogged), begun_anew(cell, std::nullopt, jogged));
      }
      at = line->clear;
      if (touch)
        first.touched(*touch);
      else
        first.failed(NotMade::kMissed);
    }
  }
  std::printf("left %d of %d places where a session without it is refused\n", left, refused_before);
  EXPECT_GT(left, 10);
}

TEST(AbandonedSearch, IsNotLeftThroughWhatStandsThereNow) {
  const Cell table = testing::table_cell(0.04, 0.0, 0);
  const Cell cell = testing::as_rough_as_stated(table, 0.005, 1);
  TouchSequenceOptions options;
  options.only_find = options.find = true;
  TouchSequence first(cell, options, {});
  JointVector at(6, 0.0);
  at[1] = -1.2, at[2] = 1.6, at[4] = 1.0;
  const auto line = first.next(at, false);
  const auto under_way = first.under_way(at, line);
  Cell blocked = cell;
  Obstacle wall;
  wall.id = "wall";
  const ArmModel arm(cell.robot, cell.tool);
  wall.frame.translation() =
      arm.nominal_tcp(testing::between(under_way->out[0], under_way->out[1], 0.5)).translation();
  wall.size_m = Eigen::Vector3d::Constant(0.02);
  blocked.obstacles.push_back(wall);
  const JointVector stands = testing::between(line->standoff, line->end, 0.5);
  EXPECT_FALSE(begun_anew(cell, under_way, stands).empty());
  const std::vector<JointVector> way = begun_anew(blocked, under_way, stands);
  EXPECT_TRUE(way.empty() || way.front() != line->clear);
}

}  // namespace
}  // namespace cellcal::calib
