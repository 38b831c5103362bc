// Figures of contacts with known noise, delay and overtravel.

#include "daemon/result/qualification.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>

#include "calib/model/linear.h"

namespace cellcal::daemon {
namespace {

constexpr double kFastMS = 0.010, kSlowMS = 0.002, kSearchM = 0.020, kDepthM = 0.012;
constexpr StatedContact kStated{3e-5, 0.0, 2e-4, 3e-4};

struct Cell {
  double noise_m = 0.0, delay_s = 0.0, overtravel_s = 0.020;
};

/// One axis that moves the tip by a metre per radian; six places, three visits each.
calib::Plan plan() {
  calib::Plan plan;
  for (int place = 0; place < kQualificationPlaces; ++place)
    for (const double share : kQualificationShares) {
      calib::PlannedTouch touch;
      touch.target = "S1";
      touch.standoff = {0.1 * place};
      touch.end = {0.1 * place + kSearchM};
      touch.search_m = kSearchM;
      touch.search_m_s = share * kFastMS;
      plan.touches.push_back(touch);
    }
  return plan;
}

RecordReading reading(const calib::Plan& plan, std::size_t touch, int number, double along_m,
                      double beyond_m) {
  RecordReading one;
  one.touch = touch;
  one.number = number;
  one.reading.slow = number > 0;
  one.reading.along_m = along_m;
  one.reading.settled_rad = {plan.touches[touch].standoff[0] + along_m + beyond_m};
  one.reading.reaction_s = 0.001 * (1 + number);
  one.reading.bounces = number;
  return one;
}

std::vector<RecordReading> readings(const calib::Plan& plan, const Cell& cell, unsigned seed = 1) {
  calib::Random random(seed);
  std::vector<RecordReading> all;
  for (std::size_t i = 0; i < plan.touches.size(); ++i)
    for (int number = 0; number <= 2; ++number) {
      const double speed = number == 0 ? plan.touches[i].search_m_s : kSlowMS;
      const double along = kDepthM + speed * cell.delay_s + cell.noise_m * random.normal();
      all.push_back(reading(plan, i, number, along, speed * cell.overtravel_s));
    }
  return all;
}

Qualification of(const Cell& cell, unsigned seed = 1) {
  const calib::Plan made = plan();
  return qualify(made, readings(made, cell, seed), kFastMS, kSlowMS, kStated);
}

bool has(const Qualification& q, QualificationFinding finding) {
  return std::find(q.findings.begin(), q.findings.end(), finding) != q.findings.end();
}

TEST(AQualification, FindsDelayAndOvertravelExactlyWhereNothingScatters) {
  const Qualification q = of({0.0, 0.003, 0.020});
  EXPECT_EQ(q.target, "S1");
  EXPECT_EQ(q.touches, 18);
  EXPECT_EQ(q.places, 6);
  ASSERT_TRUE(q.delay && q.noise_m);
  EXPECT_NEAR(q.delay->delay_s, 0.003, 1e-9);
  EXPECT_NEAR(q.noise_m->value, 0.0, 1e-9);
  ASSERT_EQ(q.overtravel.size(), 3u);
  for (std::size_t i = 0; i < 3; ++i) {
    const double speed = std::array{0.010, 0.005, 0.002}[i];
    EXPECT_DOUBLE_EQ(q.overtravel[i].speed_m_s, speed);
    EXPECT_EQ(q.overtravel[i].searches, (std::array{12, 6, 36}[i]));
    EXPECT_NEAR(q.overtravel[i].median_m, 0.020 * speed, 1e-9);
    EXPECT_NEAR(q.overtravel[i].worst_m, 0.020 * speed, 1e-9);
  }
  EXPECT_DOUBLE_EQ(q.reaction_worst_s, 0.003);
  EXPECT_EQ(q.bounces_worst, 2);
}

TEST(AQualification, HasTheMiddleOfTheOvertravelsOfAnEvenNumberOfSearches) {
  const calib::Plan made = plan();
  std::vector<RecordReading> all = readings(made, {0.0, 0.003, 0.020});
  std::size_t fast = 0;
  for (RecordReading& one : all)  // 12 at the fast speed: 0.1 mm of six, 0.3 mm of the others
    if (!one.reading.slow && made.touches[one.touch].search_m_s == kFastMS)
      one = reading(made, one.touch, 0, one.reading.along_m, fast++ % 2 == 0 ? 1e-4 : 3e-4);
  const Qualification q = qualify(made, all, kFastMS, kSlowMS, kStated);
  EXPECT_EQ(fast, 12u);
  EXPECT_NEAR(q.overtravel.at(0).median_m, 2e-4, 1e-9);
}

TEST(AQualification, KnowsItsNoiseAndDelayAsWellAsItSays) {
  double noise_sigmas = 0.0, delay_sigmas = 0.0, noise_m = 0.0;
  constexpr int kRuns = 200;
  for (unsigned seed = 1; seed <= kRuns; ++seed) {
    const Qualification q = of({3e-5, 0.001, 0.020}, seed);
    ASSERT_TRUE(q.delay && q.noise_m);
    EXPECT_EQ(q.noise_dof, 12);
    noise_m += q.noise_m->value / kRuns;
    noise_sigmas += std::pow((q.noise_m->value - 3e-5) / q.noise_m->sigma, 2) / kRuns;
    delay_sigmas += std::pow((q.delay->delay_s - 0.001) / q.delay->sigma_s, 2) / kRuns;
  }
  EXPECT_NEAR(noise_m, 3e-5, 2e-6);
  EXPECT_NEAR(noise_sigmas, 1.0, 0.6);
  EXPECT_LT(delay_sigmas, 2.0);
  EXPECT_GT(delay_sigmas, 0.3);
}

TEST(AQualification, PassesWhatIsAsStatedInNineteenOfTwentyCells) {
  int passed = 0;
  for (unsigned seed = 1; seed <= 100; ++seed) passed += of({3e-5, 1e-4, 0.020}, seed).passed();
  EXPECT_GE(passed, 95);
}

TEST(AQualification, PassesNoiseThatIsTwiceWhatIsStatedInNoCellOfTwenty) {
  int passed = 0;
  for (unsigned seed = 1; seed <= 100; ++seed) passed += of({6e-5, 1e-4, 0.020}, seed).passed();
  EXPECT_LE(passed, 8);
}

TEST(AQualification, OfSessionsThatConfirmEveryTouchMeasuresTheNoiseOfTheirMeans) {
  const calib::Plan made = plan();
  double fast = 0.0, slow = 0.0;
  for (unsigned seed = 1; seed <= 100; ++seed) {
    const auto all = readings(made, {3e-5, 0.0, 0.020}, seed);
    fast += qualify(made, all, kFastMS, kSlowMS, kStated).noise_m->value / 100;
    slow += qualify(made, all, kFastMS, kSlowMS, kStated, {}, true).noise_m->value / 100;
  }
  EXPECT_NEAR(fast, 3e-5, 3e-6);
  EXPECT_NEAR(slow, 3e-5 / std::sqrt(2.0), 3e-6);
}

TEST(AQualification, NamesEachFigureThatIsNotAsStated) {
  EXPECT_TRUE(has(of({1e-4, 0.0, 0.020}), QualificationFinding::kNoiseAboveStated));
  EXPECT_TRUE(has(of({1e-6, 0.0, 0.0301}), QualificationFinding::kOvertravelTooLong));
  EXPECT_FALSE(has(of({1e-6, 0.0, 0.0299}), QualificationFinding::kOvertravelTooLong));
  EXPECT_TRUE(has(of({3e-6, 0.004, 0.020}), QualificationFinding::kDelayNotAsStated));
  EXPECT_TRUE(has(of({3e-6, -0.004, 0.020}), QualificationFinding::kDelayNotAsStated));
  const calib::Plan made = plan();
  const auto with_radius = [&](double value, double sigma) {
    return qualify(made, readings(made, {1e-6}), kFastMS, kSlowMS, kStated, Figure{value, sigma});
  };
  EXPECT_TRUE(has(with_radius(1e-3, 5e-5), QualificationFinding::kRadiusNotAsStated));
  EXPECT_FALSE(has(with_radius(5e-4, 5e-5), QualificationFinding::kRadiusNotAsStated));
  EXPECT_FALSE(with_radius(1e-3, 2.9e-4).radius_offset_m) << "that is the prior";
  for (const QualificationFinding finding :
       {QualificationFinding::kNoiseAboveStated, QualificationFinding::kOvertravelTooLong,
        QualificationFinding::kDelayNotAsStated, QualificationFinding::kRadiusNotAsStated})
    EXPECT_STRNE(to_string(finding), "?");
}

TEST(AQualification, CountsATouchThatWasBegunAnewFromItsLastFastContactOn) {
  const calib::Plan made = plan();
  std::vector<RecordReading> all = readings(made, {});
  all.insert(all.begin(), reading(made, 0, 1, 0.007, 0.0));
  all.insert(all.begin(), reading(made, 0, 0, 0.005, 0.0));
  const Qualification q = qualify(made, all, kFastMS, kSlowMS, kStated);
  EXPECT_NEAR(q.noise_m->value, 0.0, 1e-9);
  EXPECT_NEAR(q.delay->delay_s, 0.0, 1e-9);
}

TEST(AQualification, OfTooLittleOrNoNumbersHasNoFiguresAndDoesNotPass) {
  const calib::Plan made = plan();
  EXPECT_FALSE(qualify({}, {}, kFastMS, kSlowMS, kStated).passed());
  EXPECT_FALSE(qualify(made, {}, kFastMS, kSlowMS, kStated).passed());
  std::vector<RecordReading> all = readings(made, {});
  all.resize(3);  // one touch
  const Qualification one = qualify(made, all, kFastMS, kSlowMS, kStated);
  EXPECT_FALSE(one.noise_m || one.delay || one.passed());
  all[0].reading.along_m = std::numeric_limits<double>::quiet_NaN();
  all.push_back(reading(made, 1, 0, 0.012, 0.0));
  all.back().touch = 4000000000u;
  const Qualification none = qualify(made, all, kFastMS, kSlowMS, kStated);
  EXPECT_EQ(none.touches, 0);
  EXPECT_FALSE(none.passed());
  for (const calib::Phrase& line : phrases(none))
    EXPECT_EQ(words(line).find("nan"), std::string::npos) << words(line);
}

TEST(AQualificationsWords, HaveTheNumberFirstAndWhatToDo) {
  const auto last = [](const Cell& cell) {
    const std::vector<calib::Phrase> lines = phrases(of(cell));
    return words(lines[lines.size() - 2]) + "\n" + words(lines.back());
  };
  EXPECT_EQ(last({0.0, 0.0, 0.0400}),
            "not as stated: 0.40 mm overtravel at the median (limit 0.3 mm). Set a smaller "
            "fast_search_mm_s under [motion]\nresult: not qualified");
  const std::string delay = last({1e-6, 0.004, 0.020});
  EXPECT_EQ(delay.find("not as stated: 4.0"), 0u) << delay;
  EXPECT_NE(delay.find("Set delay_ms = "), std::string::npos) << delay;
  EXPECT_EQ(words(phrases(of({0.0, 0.0, 0.020})).back()), "result: qualified");
}

TEST(AQualificationsWords, InGermanHaveDecimalCommasButForValuesOfTheCellFile) {
  const std::vector<calib::Phrase> lines = phrases(of({1e-6, 0.004, 0.020}));
  const std::string delay = words(lines[lines.size() - 2], *calib::Language::of("de"));
  EXPECT_EQ(delay.find("nicht wie angegeben: 4,0"), 0u) << delay;
  EXPECT_NE(delay.find("delay_ms = 4.0"), std::string::npos) << delay;
}

}  // namespace
}  // namespace cellcal::daemon
