// The log, as whoever reads it meets it.

#include <gtest/gtest.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cstdlib>

#include "daemon/main/log.h"

namespace cellcal::daemon {
namespace {

TEST(log, keeps_a_message_on_one_line_whatever_foreign_words_are_in_it) {
  ::unsetenv("JOURNAL_STREAM");
  ::testing::internal::CaptureStderr();
  set_up_log(false);
  spdlog::error("{}: no such file", "/tmp/a\n<3>2030-01-01 error: forged\x1b[2J");
  spdlog::default_logger()->flush();
  const std::string logged = ::testing::internal::GetCapturedStderr();
  EXPECT_EQ(std::count(logged.begin(), logged.end(), '\n'), 1) << logged;
  EXPECT_NE(logged.find("/tmp/a / <3>2030-01-01 error: forged?[2J: no such file"),
            std::string::npos)
      << logged;
}

}  // namespace
}  // namespace cellcal::daemon
