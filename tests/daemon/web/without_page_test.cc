#include <gtest/gtest.h>

#include "daemon/web/assets.h"

namespace cellcal::daemon {
namespace {

TEST(ADaemonWithoutThePage, SaysSoAndHowToBuildIt) {
  ASSERT_EQ(assets().size(), 2u);
  EXPECT_EQ(assets().back().path, "/fleet");
  EXPECT_NE(assets().back().body.find("cellcal fleet status"), std::string_view::npos);
  const Asset& only = assets().front();
  EXPECT_EQ(only.path, "/");
  EXPECT_FALSE(only.gzipped);
  EXPECT_NE(only.body.find("left out of this build"), std::string_view::npos);
  EXPECT_NE(only.body.find("tests/install page"), std::string_view::npos);
  EXPECT_NE(only.body.find("-DCELLCAL_PAGE=ON"), std::string_view::npos);
}

}  // namespace
}  // namespace cellcal::daemon
