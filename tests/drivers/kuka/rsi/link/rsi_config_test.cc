#include "drivers/kuka/rsi/rsi_config.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "tests/drivers/kuka/rsi/rig.h"

namespace cellcal::drivers {
namespace {

std::string complaint(const std::function<void(RsiConfig&)>& spoil) {
  return complaint_of(rig_config(), spoil);
}

TEST(RsiConfig, SoundOneIsAccepted) {
  EXPECT_EQ(complaint([](RsiConfig&) {}), "");
}

TEST(RsiConfig, PairingsThatMakeTheArmJumpOrRunAreRefused) {
  EXPECT_NE(complaint([](RsiConfig& c) { c.hold_on = false; }).find("HOLDON"), std::string::npos);
  const auto relative = [](RsiConfig& c) { c.mode = CorrectionMode::kRelative; };
  EXPECT_NE(complaint(relative).find("repeat"), std::string::npos);
  EXPECT_EQ(complaint([](RsiConfig& c) {
              c.mode = CorrectionMode::kRelative;
              c.hold_on = false;
            }),
            "");
}

TEST(RsiConfig, EachBadValueIsNamed) {
  const std::pair<const char*, std::function<void(RsiConfig&)>> cases[] = {
      {"sentype", [](RsiConfig& c) { c.sentype = "Im Free"; }},
      {"sentype", [](RsiConfig& c) { c.sentype = "\"/><Stop>1</Stop>"; }},
      {"axis_tag", [](RsiConfig& c) { c.axis_tag = ""; }},
      {"POSCORR", [](RsiConfig& c) { c.axis_tag = "RKORR"; }},
      {"stop_tag", [](RsiConfig& c) { c.stop_tag = std::string(33, 'x'); }},
      {"decimals", [](RsiConfig& c) { c.decimals = 3; }},
      {"silence_cycles", [](RsiConfig& c) { c.silence_cycles = 1; }},
      {"late_replies_limit", [](RsiConfig& c) { c.late_replies_limit = 0; }},
      {"0 axis limits", [](RsiConfig& c) { c.limits.clear(); }},
      {"5 correction limits", [](RsiConfig& c) { c.correction_limit_deg.pop_back(); }},
      {"axis 2: limits", [](RsiConfig& c) { c.limits[1].min_rad = 4; }},
      {"axis 3: speed", [](RsiConfig& c) { c.limits[2].max_speed_rad_s = 0; }},
      {"axis 3: acceleration", [](RsiConfig& c) { c.limits[2].max_acceleration_rad_s2 = -1; }},
      {"axis 3: jerk", [](RsiConfig& c) { c.limits[2].max_jerk_rad_s3 = NAN; }},
      {"axis 1: correction", [](RsiConfig& c) { c.correction_limit_deg[0] = INFINITY; }},
      {"follow_tolerance_deg", [](RsiConfig& c) { c.follow_tolerance_deg = 0; }},
      {"follow_window_s", [](RsiConfig& c) { c.follow_window_s = 0; }},
      {"follow_window_s", [](RsiConfig& c) { c.follow_window_s = 2; }},
      {"longest_lag_s", [](RsiConfig& c) { c.longest_lag_s = NAN; }},
      {"longest_lag_s", [](RsiConfig& c) { c.longest_lag_s = 0.6; }},
  };
  for (const auto& [words, spoil] : cases) {
    EXPECT_NE(complaint(spoil).find(words), std::string::npos) << words << ": " << complaint(spoil);
  }
}

}  // namespace
}  // namespace cellcal::drivers
