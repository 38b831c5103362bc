// Options of a session, as stored with it.

#include "daemon/tasks/options.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

namespace cellcal::daemon {
namespace {

TEST(StoredOptions, AreReadBackAsTheyWere) {
  SessionOptions options;
  options.touch.confirm_every = 5;
  options.touch.approach_least_m = 0.003;
  options.one_by_one = true;
  const SessionOptions back = options_from_json(options_to_json(options));
  EXPECT_EQ(back.touch.confirm_every, 5);
  EXPECT_EQ(back.touch.approach_least_m, 0.003);
  EXPECT_TRUE(back.one_by_one);
}

TEST(StoredOptions, OfAnEarlierVersionConfirmEveryTouchAsItDid) {
  nlohmann::json json = nlohmann::json::parse(options_to_json({}));
  EXPECT_EQ(options_from_json(json.dump()).touch.confirm_every, 8);
  json.erase("confirm_every");
  EXPECT_EQ(options_from_json(json.dump()).touch.confirm_every, 1);
}

TEST(StoredOptions, OfAKindThatThisVersionDoesNotKnowAreNoCalibration) {
  SessionOptions options;
  options.kind = SessionKind::kQualify;
  std::string stored = options_to_json(options);
  EXPECT_EQ(options_from_json(stored).kind, SessionKind::kQualify);
  SessionOptions check;
  check.kind = SessionKind::kCheck;
  check.against = 7;
  EXPECT_EQ(options_from_json(options_to_json(check)).kind, SessionKind::kCheck);
  EXPECT_EQ(options_from_json(options_to_json(check)).against, 7);
  EXPECT_FALSE(options_from_json(options_to_json(check)).temperature_c);
  EXPECT_EQ(options_from_json(options_to_json(check)).load, "");
  check.load = "part";
  EXPECT_EQ(options_from_json(options_to_json(check)).load, "part");
  check.temperature_c = 21.5;
  EXPECT_EQ(options_from_json(options_to_json(check)).temperature_c, 21.5);
  stored.replace(stored.find("qualify"), 7, "polish_");
  EXPECT_THROW(options_from_json(stored), std::runtime_error);
}

TEST(StoredOptions, ThatLackAKeyAreRefusedByItsName) {
  nlohmann::json json = nlohmann::json::parse(options_to_json({}));
  json.erase("fast_m_s");
  try {
    options_from_json(json.dump());
    FAIL() << "taken";
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find("fast_m_s"), std::string::npos);
  }
  EXPECT_THROW(options_from_json("{"), std::runtime_error);
}

}  // namespace
}  // namespace cellcal::daemon
