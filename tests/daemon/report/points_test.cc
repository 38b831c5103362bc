// Touches on points: residuals are distances in space, so they have no sign, no normal curve and no
// direction of touch.

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "daemon/report/report.h"
#include "tests/daemon/report/fixture.h"
#include "tests/daemon/report/html_checker.h"

namespace cellcal::daemon::report {
namespace {

using testing::complaints;
using testing::made_up_session;
using testing::occurrences;
using testing::says;
using testing::section_of;

// The first `points` targets of a session become points.
ReportInput session_with_points(std::size_t points, std::size_t targets = 2) {
  ReportInput input = made_up_session({.spheres = targets, .fit = 40, .check = 10, .outliers = 0});
  calib::Calibration& result = input.calibration;
  for (std::size_t i = 0; i < points; ++i) {
    result.cell.targets[i].kind = calib::TargetKind::kPoint;
    result.targets[i].effective_radius_m = 0.0;
  }
  for (calib::TouchResidual& residual : result.residuals) {
    const std::string& target = input.touches[residual.touch].target;
    for (std::size_t i = 0; i < points; ++i) {
      if (result.cell.targets[i].id != target) continue;
      residual.before_m = std::abs(residual.before_m);
      residual.after_m = std::abs(residual.after_m);
      residual.whitened = std::abs(residual.whitened);
    }
  }
  return input;
}

TEST(Points, GiveASoundDocumentThatCountsThem) {
  const std::string html = html_report(session_with_points(2));
  EXPECT_TRUE(complaints(html).empty());
  EXPECT_TRUE(says(html, "40 touches on 2 points determined"));
  EXPECT_TRUE(says(html_report(session_with_points(1)), "40 touches on 2 targets determined"));
}

TEST(Points, AreDrawnFromZeroUpwards) {
  const std::string chart = section_of(html_report(session_with_points(2)), "residuals");
  EXPECT_FALSE(says(chart, ">\xE2\x88\x92")) << "no negative tick";
  EXPECT_TRUE(says(chart, "it has no sign"));
  const std::string mixed = section_of(html_report(session_with_points(1)), "residuals");
  EXPECT_TRUE(says(mixed, ">\xE2\x88\x92"));
  EXPECT_TRUE(says(mixed, "on points, the distance without sign"));
}

TEST(Points, AreShadedUpToWhatNoiseAlongThreeAxesReaches) {
  // 0.03 mm along each axis: 95 % of the distances stay below sqrt(7.815) times that.
  EXPECT_TRUE(
      says(section_of(html_report(session_with_points(2)), "residuals"), " 0.084 mm contain"));
}

TEST(Points, AreComparedWithTheCurveOfDistances) {
  ReportInput input = session_with_points(2);
  for (calib::TouchResidual& residual : input.calibration.residuals) residual.whitened = 1.75;
  const std::string histogram = section_of(html_report(input), "distribution");
  EXPECT_TRUE(says(histogram, "curve of a normal error in space"));
  EXPECT_TRUE(says(histogram, "about 1.7)</th><td>1.75</td>"));
  EXPECT_FALSE(says(histogram, ">\xE2\x88\x92")) << "no negative tick";
}

TEST(Points, BesideSpheresAreLeftOutOfTheHistogramInWords) {
  ReportInput input = session_with_points(1);
  for (calib::TouchResidual& residual : input.calibration.residuals) {
    residual.whitened = input.touches[residual.touch].target == "S1" ? 3.0 : 1.0;
  }
  const std::string histogram = section_of(html_report(input), "distribution");
  EXPECT_TRUE(says(histogram, "25 touches on points are not drawn"));
  EXPECT_TRUE(says(histogram, "<td>1.00</td>"));
  EXPECT_FALSE(says(histogram, "curve of a normal error in space"));
}

TEST(Points, HaveNoMeanResidualAndNoMapOfTouches) {
  const std::string html = html_report(session_with_points(2));
  EXPECT_EQ(section_of(html, "directions"), "");
  const std::string targets = section_of(html, "targets");
  EXPECT_EQ(occurrences(targets, "<td>25</td><td>\xE2\x80\x93</td><td>0."), 2U);
  EXPECT_TRUE(says(targets, "residuals on points are distances and have none"));
}

// S1 becomes a plane, S2 a tracker.
ReportInput session_with_plane_and_tracker() {
  ReportInput input = session_with_points(2, 3);
  calib::Calibration& result = input.calibration;
  result.cell.lengths.clear();
  const calib::TargetKind kinds[] = {calib::TargetKind::kPlane, calib::TargetKind::kTracker};
  for (std::size_t i = 0; i < 2; ++i)
    result.cell.targets[i].kind = result.targets[i].kind = kinds[i];
  result.targets[0].normal = Eigen::Vector3d(0.6, 0.0, 0.8);
  result.targets[0].distance_m = 0.51234;
  result.targets[0].effective_radius_m = 0.0021;
  result.targets[1].frame.translation() = Eigen::Vector3d(3.0, -2.0, 1.0);
  return input;
}

TEST(PlanesAndTrackers, AreSaidToStandWhereTheyDo) {
  const std::string html = html_report(session_with_plane_and_tracker());
  EXPECT_TRUE(complaints(html).empty());
  const std::string targets = section_of(html, "targets");
  EXPECT_TRUE(says(targets, "S1: plane, normal (+0.60000, "));
  EXPECT_TRUE(says(targets, "512.340&nbsp;mm from the base"));
  EXPECT_TRUE(says(targets, "S2: tracker, its frame at (3000.000, "));
}

TEST(PlanesAndTrackers, HaveNoMapOfTouchesAndATrackerIsNotDrawnInTheCell) {
  const std::string html = html_report(session_with_plane_and_tracker());
  const std::string maps = section_of(html, "directions");
  EXPECT_FALSE(says(maps, "Touches on S1"));
  EXPECT_FALSE(says(maps, "Touches on S2"));
  EXPECT_TRUE(says(maps, "Touches on S3"));
  const std::string cell = section_of(html, "cell");
  EXPECT_TRUE(says(cell, "S1"));
  EXPECT_FALSE(says(cell, "S2"));
  EXPECT_FALSE(says(cell, "cannot be drawn"));
}

}  // namespace
}  // namespace cellcal::daemon::report
