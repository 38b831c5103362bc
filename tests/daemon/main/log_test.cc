// A message is one line of the log without terminal control characters, whatever its content.

#include "daemon/files/log.h"

#include <gtest/gtest.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <string>

#include "daemon/files/atomic_file.h"

namespace cellcal::daemon {
namespace {

TEST(TheLog, CannotBeForgedByWhatItTellsOf) {
  const auto before = spdlog::default_logger();
  ::testing::internal::CaptureStderr();
  set_up_log(false);
  spdlog::info("cell {}",
               "/a\n<3>session 7 is done\r\x1b[2J\x7f\xC2\x9B"
               "31m.toml");
  spdlog::default_logger()->flush();
  const std::string written = ::testing::internal::GetCapturedStderr();
  spdlog::drop("cellcald");
  spdlog::set_default_logger(before);
  ASSERT_FALSE(written.empty());
  EXPECT_EQ(written.back(), '\n');
  EXPECT_EQ(std::count(written.begin(), written.end(), '\n'), 1) << written;
  for (const char bad : {'\r', '\x1b', '\x7f'}) {
    EXPECT_EQ(written.find(bad), std::string::npos) << written;
  }
  EXPECT_EQ(written.find("\xC2\x9B"), std::string::npos) << written;
  EXPECT_NE(written.find("cell /a <3>session 7 is done"), std::string::npos) << written;
}

TEST(PrintableText, LeavesWordsOfAllLanguagesAlone) {
  const std::string words = "K\xC3\xBChlung 0.05 \xC2\xB1 0.01 \xC2\xB5m, \xE2\x80\x93";
  EXPECT_EQ(printable(words), words);
  EXPECT_EQ(printable("\xC2"), "\xC2");
}

}  // namespace
}  // namespace cellcal::daemon
