#include "daemon/files/child.h"

#include <gtest/gtest.h>

#include <cerrno>

namespace cellcal::daemon::testing {
namespace {

using Why = ChildEnd::Why;

ChildEnd shell(const std::string& script, Child child = {}) {
  child.words = {"sh", "-c", script};
  if (child.most_output == 0) child.most_output = 1u << 20;
  return run_child(child);
}

TEST(AChild, TakesItsInputAndGivesOutputAndStatus) {
  const std::string much(300000, 'x');
  const ChildEnd end = shell("cat; echo wrong >&2; exit 3", {.words = {}, .input = much});
  EXPECT_EQ(end.why, Why::kEnded);
  EXPECT_EQ(end.status, 3);
  EXPECT_EQ(end.out, much);
  EXPECT_EQ(end.err, "wrong\n");
}

TEST(AChild, HasItsArgumentsAsTheyAre) {
  const ChildEnd end =
      run_child({.words = {"printf", "%s|", "a b", "$(id)", "'"}, .most_output = 100});
  EXPECT_EQ(end.out, "a b|$(id)|'|");
}

TEST(AChild, ThatIsNotThereIsNamedByItsError) {
  const ChildEnd end = run_child({.words = {"no_such_program_of_this_test"}});
  EXPECT_EQ(end.why, Why::kNotStarted);
  EXPECT_EQ(end.error, ENOENT);
}

TEST(AChild, ThatGoesOnIsEnded) {
  for (const std::size_t output : {std::size_t{0}, std::size_t{100}}) {
    const ChildEnd end = run_child({.words = {"sleep", "1000"},
                                    .limit = std::chrono::milliseconds(50),
                                    .most_output = output});
    EXPECT_EQ(end.why, Why::kTooLong);
    EXPECT_EQ(end.status, -1);
  }
}

TEST(AChild, ThatWritesForEverIsEnded) {
  for (const char* script : {"yes", "yes >&2"}) {
    const ChildEnd end = shell(script, {.words = {}, .most_output = 1000});
    EXPECT_EQ(end.why, Why::kTooMuch);
    EXPECT_LT(end.out.size() + end.err.size(), 100000U);
  }
}

TEST(AChild, EndedByASignalHasNoStatus) { EXPECT_EQ(shell("kill -9 $$").status, -1); }

TEST(AChild, HasTheGivenEnvironmentAlone) {
  const ChildEnd end =
      run_child({.words = {"/usr/bin/env"}, .most_output = 1000, .environment = {"PATH=/usr/bin"}});
  EXPECT_EQ(end.out, "PATH=/usr/bin\n");
}

}  // namespace
}  // namespace cellcal::daemon::testing
