// Check touches of a target without fit touches: they alone determine its place, and their
// residuals judge the arm.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "calib/identify/identify.h"
#include "calib/identify/identify_once.h"
#include "calib/verdict/held_out.h"
#include "tests/calib/findings.h"
#include "tests/calib/simulate.h"

namespace cellcal::calib {
namespace {

using testing::demo_cell;
using testing::found;
using testing::make_touches;
using testing::Making;
using testing::plain_truth;
using testing::the;
using testing::words_of;
using NotJudged = UnseenTarget::NotJudged;

/// S1 to S3 have fit touches; of the touches of S4 `kept` are check touches, the rest is dropped.
std::vector<Touch> with_one_unseen(unsigned seed, std::size_t kept, const sim::Truth& truth_of_s4) {
  Making making;
  making.fit = 80;
  making.seed = seed;
  std::vector<Touch> touches;
  const auto all = make_touches(demo_cell(), plain_truth(demo_cell(), seed), making).touches;
  const auto last = make_touches(demo_cell(), truth_of_s4, making).touches;
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (all[i].target != "S4") {
      touches.push_back(all[i]);
    } else if (kept > 0) {
      --kept;
      touches.push_back(last[i]);
      touches.back().set = TouchSet::kCheck;
    }
  }
  return touches;
}

TEST(UnseenTarget, IsJudgedWithThePlaceOfItsOwnCheckTouches) {
  const auto touches = with_one_unseen(1, 12, plain_truth(demo_cell(), 1));
  const Calibration c = identify(demo_cell(), touches);
  EXPECT_TRUE(c.verdict.publish()) << words_of(c);
  EXPECT_EQ(c.check.count, 12);
  EXPECT_EQ(c.check_before.count, 12);
  EXPECT_LT(c.check.rms_m, 0.1e-3);
  EXPECT_GT(c.check_before.rms_m, 5.0 * c.check.rms_m);
  ASSERT_EQ(c.unseen.targets.size(), 1u);
  EXPECT_EQ(c.unseen.targets[0].target, "S4");
  // Twelve touches minus three for the place; the certified diameter contributes almost nothing.
  EXPECT_NEAR(c.unseen.targets[0].degrees_of_freedom, 9.0, 0.3);
  EXPECT_EQ(the(c, FindingKind::kUnseenPlace).about.name, "S4") << words_of(c);
  EXPECT_FALSE(found(c, FindingKind::kNotTouched)) << words_of(c);
  for (const TouchResidual& r : c.residuals) {
    EXPECT_TRUE(std::isfinite(r.before_m) && std::isfinite(r.after_m)) << r.touch;
    EXPECT_FALSE(r.outlier) << r.touch;
  }
}

TEST(UnseenTarget, CountsWhatItsPlaceTookUp) {
  // Over many arms the squared row relative to its prediction is one, for any number of touches.
  for (const std::size_t kept : {5u, 12u}) {
    double square = 0.0, rows = 0.0;
    for (unsigned seed = 1; seed <= 12; ++seed) {
      IdentifyOptions options;
      options.level = ModelLevel{0.3, 1.0, 0.0};
      const Calibration c = identify_single_pass(
          demo_cell(), with_one_unseen(seed, kept, plain_truth(demo_cell(), seed)), options);
      for (const HeldOut& one : c.unseen.held_out) {
        square += one.square;
        rows += one.rows;
      }
    }
    std::printf("%zu check touches of an unseen sphere: %.2f of one, %.1f rows\n", kept,
                square / rows, rows);
    EXPECT_NEAR(rows, 12.0 * (static_cast<double>(kept) - 3.0), 0.05 * rows);
    EXPECT_GT(square / rows, 0.5);
    EXPECT_LT(square / rows, 1.6);
  }
}

TEST(UnseenTarget, WithholdsAResultThatIsWrongThere) {
  // S4 is touched by a different arm, as if with an unmodelled compliance.
  const auto touches = with_one_unseen(2, 12, plain_truth(demo_cell(), 3));
  const Calibration c = identify(demo_cell(), touches);
  EXPECT_FALSE(c.verdict.publish());
  EXPECT_TRUE(found(c, FindingKind::kCheckTouches)) << words_of(c);
}

TEST(UnseenTarget, ThatIsTouchedTooLittleIsNotJudgedAndWhyIsSaid) {
  for (const std::size_t kept : {1u, 3u, 4u}) {
    const auto touches = with_one_unseen(1, kept, plain_truth(demo_cell(), 1));
    const Calibration c = identify(demo_cell(), touches);
    EXPECT_TRUE(c.verdict.publish()) << words_of(c);
    EXPECT_EQ(c.check.count, 0) << kept;
    EXPECT_EQ(the(c, FindingKind::kUnseenNotJudged).about.name, "S4") << words_of(c);
    EXPECT_EQ(the(c, FindingKind::kUnseenNotJudged, "touches"), static_cast<double>(kept));
    EXPECT_EQ(the(c, FindingKind::kUnseenNotJudged, "place_alone"), 1.0) << words_of(c);
    EXPECT_EQ(c.unseen.targets[0].not_judged, NotJudged::kPlaceAlone);
    EXPECT_TRUE(found(c, FindingKind::kNoCheckTouches)) << words_of(c);
  }
}

TEST(UnseenTarget, WhosePlaceItsTouchesDoNotGiveIsNotJudged) {
  Cell cell = demo_cell();
  Target& s4 = cell.targets[cell.target_index("S4")];
  s4.has_centre = false;
  const Calibration c = identify(cell, with_one_unseen(1, 1, plain_truth(demo_cell(), 1)));
  ASSERT_EQ(c.unseen.targets.size(), 1u);
  EXPECT_EQ(c.unseen.targets[0].not_judged, NotJudged::kNoPlace);
  EXPECT_EQ(c.unseen.targets[0].touches, 1u);
  EXPECT_EQ(the(c, FindingKind::kUnseenNotJudged, "no_place"), 1.0) << words_of(c);
}

}  // namespace
}  // namespace cellcal::calib
