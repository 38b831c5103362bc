#include "daemon/fleet/connection.h"

#include <gtest/gtest.h>

namespace cellcal::daemon::fleet {
namespace {

bool has(const std::string& connection, const std::string& words) {
  return (" " + with_time_limits(connection)).find(" " + words + " ") != std::string::npos;
}

TEST(FleetConnection, EveryWayToNameADatabaseHasTimeLimits) {
  for (const char* named :
       {"dbname=cellcal host=db.plant.example",
        "postgresql://collector:a%3Fb@db.plant.example:5433/cellcal?sslmode=require",
        "postgres://db.plant.example/cellcal"}) {
    EXPECT_TRUE(has(named, "connect_timeout='10'")) << named;
    EXPECT_TRUE(has(named, "keepalives_idle='10'")) << named;
    EXPECT_TRUE(has(named, "tcp_user_timeout='30000'")) << named;
    EXPECT_TRUE(has(named, "host='db.plant.example'")) << named;
    EXPECT_TRUE(has(named, "dbname='cellcal'")) << named;
  }
  EXPECT_TRUE(has("postgresql://u:a%3Fb@h/d?sslmode=require", "password='a?b'"));
  EXPECT_TRUE(has("postgresql://u:a%3Fb@h/d?sslmode=require", "sslmode='require'"));
}

TEST(FleetConnection, WhatTheOwnerStatesCounts) {
  for (const char* named :
       {"dbname=cellcal connect_timeout=3", "postgresql:///cellcal?connect_timeout=3"}) {
    EXPECT_TRUE(has(named, "connect_timeout='3'")) << named;
    EXPECT_FALSE(has(named, "connect_timeout='10'")) << named;
  }
}

TEST(FleetConnection, APasswordsQuotesStayWhatTheyAre) {
  EXPECT_TRUE(has("postgresql://u:it's%5C@h/d", "password='it\\'s\\\\'"));
}

TEST(FleetConnection, WhatIsNoneIsLeftForTheOneWhoConnectsToName) {
  EXPECT_EQ(with_time_limits("no words"), "no words");
}

}  // namespace
}  // namespace cellcal::daemon::fleet
