// '.' is the decimal point in every locale.

#include <gtest/gtest.h>

#include <clocale>
#include <cstdlib>
#include <filesystem>
#include <locale>

#include "tests/calib/files/documents.h"

namespace cellcal::calib {
namespace {

struct Texts {
  std::string robot, cell, touches, refusal;
  bool operator==(const Texts&) const = default;
};

/// All readers and writers of numbers.
Texts all_texts() {
  const Cell cell = testing::cell();
  return {robot_to_toml(testing::robot()), cell_to_toml(cell, "two.toml"),
          format_touches(parse_touches(testing::kTouches, "touches.csv", cell), cell.robot),
          testing::cell_refusal(testing::with(testing::kCell, "mm = 500.012", "mm = -0.5"))};
}

/// The C++ standard library's own locale, as an embedding program may have set it.
class CommaPunctuation : public std::numpunct<char> {
  char do_decimal_point() const override { return ','; }
  char do_thousands_sep() const override { return '.'; }
  std::string do_grouping() const override { return "\3"; }
};

TEST(Locale, OfStreamsDoesNotMatter) {
  const Texts expected = all_texts();
  const std::locale before =
      std::locale::global(std::locale(std::locale::classic(), new CommaPunctuation));
  const Texts there = all_texts();
  std::locale::global(before);
  EXPECT_EQ(there, expected);
}

/// Sets a German locale, compiled if the machine has only its sources.
bool set_german() {
  for (const char* name : {"de_DE.UTF-8", "de_DE.utf8", "de_DE"})
    if (std::setlocale(LC_ALL, name) != nullptr) return true;
  const std::filesystem::path folder =
      std::filesystem::path(::testing::TempDir()) / ("locales-" + std::to_string(::getpid()));
  std::filesystem::create_directories(folder);
  const std::string command = "localedef -i de_DE -f UTF-8 --no-archive " +
                              (folder / "de_DE.UTF-8").string() + " >/dev/null 2>&1";
  const bool made = std::system(command.c_str()) == 0;
  bool set = false;
  if (made) {
    ::setenv("LOCPATH", folder.c_str(), 1);
    set = std::setlocale(LC_ALL, "de_DE.UTF-8") != nullptr;
    ::unsetenv("LOCPATH");
  }
  std::filesystem::remove_all(folder);
  return set;
}

TEST(Locale, OfGermanyDoesNotMatter) {
  const Texts expected = all_texts();
  if (!set_german()) GTEST_SKIP() << "no German locale here, and none can be made";
  ASSERT_STREQ(std::localeconv()->decimal_point, ",");
  const Texts there = all_texts();
  std::setlocale(LC_ALL, "C");
  EXPECT_EQ(there, expected);
}

}  // namespace
}  // namespace cellcal::calib
