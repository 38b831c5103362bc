#include "daemon/plant/line/cell_metrics.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <set>
#include <sstream>

namespace cellcal::daemon::testing {
namespace {

using namespace plant::sparkplug;

const Metric& of(const std::vector<Metric>& all, const std::string& name) {
  return *std::ranges::find(all, name, &Metric::name);
}

CellNow everything() {
  CellNow now;
  now.software = "1.2";
  now.phase = "transit";
  now.running = true;
  now.session = CellNow::Session{7, "calibrate", 12, 40, "robot-silent"};
  now.calibration = CellNow::InUse{5, 1700000000.0, true, 62e-6, 150e-6};
  now.check = CellNow::Check{6, 1700000001.5, true, 31e-6};
  now.drift_state = "in-control";
  now.drift_advice = "none";
  now.link = CellNow::Link{true, 1, 2, 3};
  return now;
}

TEST(ACellsMetrics, AreMillimetresAndMillisecondsAndHaveTheTypeThatTheySay) {
  const auto all = metrics_of(everything());
  EXPECT_EQ(of(all, "Calibration/Predicted error mm").value, decltype(Metric::value)(0.062));
  EXPECT_EQ(of(all, "Calibration/u95 mm").value, decltype(Metric::value)(0.15));
  EXPECT_EQ(of(all, "Calibration/Scope").value, decltype(Metric::value)(std::string("workspace")));
  EXPECT_EQ(of(all, "Calibration/Time").value,
            decltype(Metric::value)(std::int64_t{1700000000000}));
  EXPECT_EQ(of(all, "Check/Time").value, decltype(Metric::value)(std::int64_t{1700000001500}));
  EXPECT_EQ(of(all, "Check/TCP shift mm").value, decltype(Metric::value)(0.031));
  EXPECT_EQ(of(all, "Session/Failure").value, decltype(Metric::value)(std::string("robot-silent")));
  EXPECT_EQ(of(all, "Link/Sensor damaged frames").value, decltype(Metric::value)(std::int64_t{3}));
  for (const Metric& one : all) {
    const std::size_t is = one.value.index();
    switch (one.type) {
      case DataType::kInt64:
      case DataType::kDateTime: EXPECT_EQ(is, 1U) << one.name; break;
      case DataType::kDouble: EXPECT_EQ(is, 2U) << one.name; break;
      case DataType::kBoolean: EXPECT_EQ(is, 3U) << one.name; break;
      case DataType::kString: EXPECT_EQ(is, 4U) << one.name; break;
    }
  }
}

TEST(ACellsMetrics, AreTheSameOnesWhereNothingIsKnownAndNull) {
  const auto all = metrics_of(everything()), none = metrics_of({});
  ASSERT_EQ(all.size(), none.size());
  std::set<std::string> names;
  for (std::size_t i = 0; i < all.size(); ++i) {
    EXPECT_EQ(all[i].name, none[i].name);
    EXPECT_EQ(all[i].type, none[i].type);
    EXPECT_TRUE(names.insert(all[i].name).second) << all[i].name;
    const bool always = all[i].name.starts_with("Properties/") || all[i].name.starts_with("State/");
    EXPECT_EQ(none[i].value.index() == 0, !always) << all[i].name;
  }
}

TEST(ACellsMetrics, StandInTheReadmeEachByItsName) {
  std::ifstream file(CELLCAL_SPARKPLUG_README);
  std::stringstream text;
  text << file.rdbuf();
  for (const Metric& one : metrics_of({}))
    EXPECT_NE(text.str().find('`' + one.name + '`'), std::string::npos) << one.name;
}

}  // namespace
}  // namespace cellcal::daemon::testing
