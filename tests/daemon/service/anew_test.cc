#include <gtest/gtest.h>

#include "daemon/service/kind.h"

namespace cellcal::daemon {
namespace {

const SessionInputs kInputs{"/cells/weld.toml", "", "", "", ""};

TEST(TheCommandOfANewSession, BeginsTheSameCheck) {
  SessionOptions options;
  options.kind = SessionKind::kCheck;
  options.against = 3;
  EXPECT_EQ(anew(options, kInputs), "cellcal check --calibration 3");
  options.mastered = {"A2", "A3"};
  options.temperature_c = 21.5;
  options.load = "full";
  EXPECT_EQ(anew(options, kInputs),
            "cellcal check --calibration 3 --mastered A2,A3 --temperature 21.5 --load full");
}

TEST(TheCommandOfANewSession, BeginsTheSameDryRun) {
  SessionOptions options;
  options.kind = SessionKind::kDryRun;
  options.plan.fit_touches = 400;
  options.plan.check_touches = 10;
  options.plan.seed = 5;
  EXPECT_EQ(anew(options, {"/my cells/o'neil.toml", "", "", "", ""}),
            "cellcal dry-run --cell '/my cells/o'\\''neil.toml' --touches 400 --check 10 --seed 5");
}

TEST(TheCommandOfANewSession, BeginsTheSameUpdate) {
  SessionOptions options;
  options.update = true;
  EXPECT_EQ(anew(options, kInputs), "cellcal run --cell /cells/weld.toml --update");
  options.accept_change = true;
  options.load = "empty gripper";
  EXPECT_EQ(anew(options, kInputs),
            "cellcal run --cell /cells/weld.toml --update --accept-change --load 'empty gripper'");
}

TEST(TheCommandOfANewSession, IsNoneOfAKindThatIsResumed) {
  for (const SessionKind kind :
       {SessionKind::kCalibrate, SessionKind::kQualify, SessionKind::kFind}) {
    SessionOptions options;
    options.kind = kind;
    EXPECT_EQ(anew(options, kInputs), "");
  }
}

}  // namespace
}  // namespace cellcal::daemon
