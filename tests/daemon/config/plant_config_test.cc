// [plant], and its refusals.

#include <gtest/gtest.h>

#include "daemon/config/config.h"
#include "tests/daemon/config/reason.h"

namespace cellcal::daemon {
namespace {

const std::string kPlant = "format = \"cellcal.daemon/1\"\nbackend = \"mock\"\n[plant]\n";

DaemonConfig parsed(const std::string& plant) { return parse_config(kPlant + plant, "d.toml"); }

std::string refusal_of_plant(const std::string& plant) { return testing::reason(kPlant + plant); }

const std::string kNamed =
    "plant = \"graz\"\ncell = \"weld-3\"\nbroker = \"broker.plant.example\"\n";

TEST(Plant, IsNoneUnlessOneIsNamed) {
  EXPECT_FALSE(parsed("").plant);
  EXPECT_EQ(refusal_of_plant("touches = true\n"),
            "d.toml:4: plant.touches: has no effect without plant. Set plant, cell and broker");
}

TEST(Plant, IsReachedOverTlsUnlessTheOwnerSaysOtherwise) {
  EXPECT_TRUE(parsed(kNamed).plant->tls);
  EXPECT_EQ(parsed(kNamed).plant->port, 8883);
  EXPECT_NE(refusal_of_plant(kNamed + "tls = false\n").find("plant.tls: without TLS"),
            std::string::npos);
  EXPECT_EQ(parsed(kNamed + "tls = false\nallow_plain = true\n").plant->port, 1883);
  EXPECT_EQ(refusal_of_plant("plant = \"g\"\ncell = \"c\"\nbroker = \"127.0.0.1\"\ntls = false\n"),
            "accepted");
  EXPECT_NE(refusal_of_plant(kNamed + "tls = false\nallow_plain = true\nca = \"/c.pem\"\n")
                .find("plant.ca"),
            std::string::npos);
}

TEST(Plant, HasNamesThatCanStandInATopicAndKeysThatBelongTogether) {
  for (const char* name : {"", "a/b", "+", "#", "ä"})
    EXPECT_NE(
        refusal_of_plant("plant = \"" + std::string(name) + "\"\ncell = \"c\"\nbroker = \"b\"\n")
            .find("plant.plant"),
        std::string::npos)
        << name;
  EXPECT_NE(
      refusal_of_plant("plant = \"g\"\ncell = \"c\"\nbroker = \"mqtt://b\"\n").find("plant.broker"),
      std::string::npos);
  EXPECT_NE(refusal_of_plant(kNamed + "certificate = \"/c\"\n").find("needs key as well"),
            std::string::npos);
  EXPECT_NE(
      refusal_of_plant(kNamed + "password_file = \"/p\"\n").find("has no effect without user"),
      std::string::npos);
  EXPECT_EQ(parsed(kNamed + "former = [\"graz/weld-2\"]\n").plant->former,
            std::vector<std::string>{"graz/weld-2"});
  for (const char* name : {"weld-2", "graz/", "/weld-2", "graz/weld/2", "graz/#"})
    EXPECT_NE(refusal_of_plant(kNamed + "former = [\"" + name + "\"]\n")
                  .find("plant.former: \"" + std::string(name)),
              std::string::npos)
        << name;
  EXPECT_NE(refusal_of_plant(kNamed + "outbox_megabytes = 0.1\n").find("plant.outbox_megabytes"),
            std::string::npos);
}

TEST(Plant, HasASparkplugNodeOnlyWhereThatIsAskedFor) {
  EXPECT_FALSE(parsed(kNamed).plant->sparkplug);
  EXPECT_TRUE(parsed(kNamed + "sparkplug = true\n").plant->sparkplug);
  EXPECT_NE(
      refusal_of_plant("sparkplug = true\n").find("plant.sparkplug: has no effect without plant"),
      std::string::npos);
  EXPECT_NE(refusal_of_plant(kNamed + "sparkplug = 1\n").find("plant.sparkplug"),
            std::string::npos);
}

TEST(Plant, IsAnsweredWithoutAPersonOnlyWhereNothingMovesByIt) {
  EXPECT_EQ(parsed(kNamed + "accept = [\"check\", \"activate\"]\n").plant->accept.size(), 2u);
  for (const char* kind : {"schedule", "priors", "move", ""})
    EXPECT_NE(refusal_of_plant(kNamed + "accept = [\"" + kind + "\"]\n").find("plant.accept"),
              std::string::npos)
        << kind;
}

}  // namespace
}  // namespace cellcal::daemon
