// System errors of a file, in words.

#include <gtest/gtest.h>

#include <filesystem>

#include "daemon/files/atomic_file.h"

namespace cellcal::daemon {
namespace {

TEST(SystemWords, NameTheFileAndWhatToCheckAndNoFunctionOfTheLibrary) {
  std::string words;
  try {
    std::filesystem::create_directories("/proc/none/of/this");
  } catch (const std::exception& error) {
    words = system_words(error);
  }
  EXPECT_EQ(words.find("/proc/none"), 0u) << words;
  EXPECT_EQ(words.find("filesystem error"), std::string::npos) << words;
  EXPECT_NE(words.find("Check the path"), std::string::npos) << words;
  EXPECT_EQ(system_words(std::runtime_error("as it is")), "as it is");
}

TEST(AWordOfAShell, IsQuotedOnlyWhereItIsNeeded) {
  EXPECT_EQ(shell_word("/cells/weld-3.toml"), "/cells/weld-3.toml");
  EXPECT_EQ(shell_word("/tmp/Zelle S\xC3\xBC"
                       "d \"A\".toml"),
            "'/tmp/Zelle S\xC3\xBC"
            "d \"A\".toml'");
  EXPECT_EQ(shell_word("o'neil"), "'o'\\''neil'");
  EXPECT_EQ(shell_word(""), "''");
}

}  // namespace
}  // namespace cellcal::daemon
