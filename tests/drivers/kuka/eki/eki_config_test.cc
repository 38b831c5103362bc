#include "drivers/kuka/eki/eki_config.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "tests/drivers/kuka/eki/eki_rig.h"

namespace cellcal::drivers {
namespace {

TEST(EkiConfig, IsAcceptedAsItComes) {
  EXPECT_EQ(complaint_of(eki_config(), [](EkiConfig&) {}), "");
}

TEST(EkiConfig, NamesWhatIsWrong) {
  const std::pair<const char*, std::function<void(EkiConfig&)>> cases[] = {
      {"address", [](EkiConfig& c) { c.address.clear(); }},
      {"silence_s", [](EkiConfig& c) { c.silence_s = 0.0; }},
      {"silence_s", [](EkiConfig& c) { c.silence_s = NAN; }},
      {"beat_s", [](EkiConfig& c) { c.beat_s = 1.0; }},
      {"window", [](EkiConfig& c) { c.window = 9; }},
      {"latch_delay_s", [](EkiConfig& c) { c.latch_delay_s = 1.0; }},
      {"flag_search_limit_deg_s", [](EkiConfig& c) { c.flag_search_limit_deg_s = 0.0; }},
      {"0 axis limits", [](EkiConfig& c) { c.limits.clear(); }},
      {"full speeds", [](EkiConfig& c) { c.full_speed_rad_s.pop_back(); }},
      {"axis 2", [](EkiConfig& c) { c.limits[1].min_rad = 9.0; }},
      {"axis 3", [](EkiConfig& c) { c.limits[2].max_speed_rad_s = 0.0; }},
      {"1 percent", [](EkiConfig& c) { c.limits[2].max_speed_rad_s = 1e-4; }},
  };
  for (const auto& [word, spoil] : cases) {
    const std::string reason = complaint_of(eki_config(), spoil);
    EXPECT_NE(reason.find(word), std::string::npos) << word << ": " << reason;
  }
}

TEST(EkiConfig, TransitsAtThePercentThatNoAxisIsTooFastFor) {
  EkiConfig config = eki_config();
  EXPECT_EQ(config.transit_percent(), 50);
  config.limits[3].max_speed_rad_s = 0.2 * config.full_speed_rad_s[3];
  EXPECT_EQ(config.transit_percent(), 20);
  config.limits[3].max_speed_rad_s = 0.0199 * config.full_speed_rad_s[3];
  EXPECT_EQ(config.transit_percent(), 1);
}

}  // namespace
}  // namespace cellcal::drivers
