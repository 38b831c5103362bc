#include "daemon/cli/tables.h"

#include <gtest/gtest.h>

namespace cellcal::daemon {
namespace {

TEST(the_result, shows_before_after_check_and_the_verdict_with_scope_and_reasons) {
  calib::Calibration calibration;
  calibration.before = {24, 0.0012, 0.0034, 0.0015};
  calibration.after = {24, 0.00003, 0.00009, 0.00004};
  calibration.verdict.workspace = true;
  calibration.verdict.reasons = {"too few directions"};
  calibration.outliers = {{4, 0.0005, "5 sigma"}};
  const std::string words = result_words(calibration);
  EXPECT_NE(words.find("fit before          24    1.2000    3.4000    1.5000\n"), std::string::npos)
      << words;
  EXPECT_NE(words.find("fit after           24    0.0300    0.0900    0.0400\n"), std::string::npos)
      << words;
  EXPECT_NE(words.find("check after       none\n"), std::string::npos) << words;
  EXPECT_NE(words.find("outlier: touch 5 (+0.500 mm): 5 sigma\n"), std::string::npos) << words;
  EXPECT_NE(words.find("verdict: NOT publishable, scope: workspace\n  - too few directions\n"),
            std::string::npos)
      << words;
}

}  // namespace
}  // namespace cellcal::daemon
