// Common properties of all commands: help with an example, exit statuses, one line first.

#include "daemon/cli/commands.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/daemon/cli/process.h"

namespace cellcal::daemon::testing {
namespace {

void expect_help(const CLI::App& command, const std::string& of) {
  EXPECT_NE(command.get_description(), "") << of;
  if (!command.get_name().empty()) {  // no group of options
    EXPECT_NE(command.get_footer().find("Example: cellcal "), std::string::npos) << of;
  }
  for (const CLI::Option* option : command.get_options())
    EXPECT_NE(option->get_description(), "") << of << " " << option->get_name();
  for (const CLI::App* inner : command.get_subcommands([](const CLI::App*) { return true; }))
    expect_help(*inner, of + " " + inner->get_name());
}

TEST(Cellcal, StatesWhatEveryCommandAndOptionIsFor) {
  CLI::App app;
  int status = 0;
  describe_cellcal(app, status);
  expect_help(app, "cellcal");
  EXPECT_TRUE(app.get_subcommand("qualify")->get_footer().ends_with(
      "Exit status 3:\nnot as stated.\nExample: cellcal qualify --cell cell.toml --target S1"));
  EXPECT_EQ(
      app.get_subcommand("check")->get_option("--mastered")->get_description(),
      "Joints that were mastered by 'cellcal mastering': four to six touches in 20 s show what is left of their "
      "zeros");
}

class EveryCommand : public ::testing::TestWithParam<const char*> {};

TEST_P(EveryCommand, HasHelpWithAnExampleAndJson) {
  const Outcome help = run_program({CELLCAL, GetParam(), "--help"});
  EXPECT_EQ(help.status, 0);
  EXPECT_NE(help.out.find(std::string("Example: cellcal ") + GetParam()), std::string::npos)
      << help.out;
  const bool has_json = help.out.find("--json") != std::string::npos;
  EXPECT_TRUE(has_json) << help.out;
  EXPECT_EQ(help.err, "");
}

TEST_P(EveryCommand, RefusesOptionsThatItDoesNotKnow) {
  const Outcome outcome = run_program({CELLCAL, GetParam(), "--no-such-option"});
  EXPECT_EQ(outcome.status, 2);
  EXPECT_EQ(outcome.err.find(std::string("cellcal ") + GetParam() + ": "), 0u) << outcome.err;
  EXPECT_EQ(outcome.out, "");
}

INSTANTIATE_TEST_SUITE_P(Cli, EveryCommand,
                         ::testing::Values("identify", "predict", "plan", "robots", "kuka-files",
                                           "run", "status", "watch", "abort", "history", "show",
                                           "report", "token", "new-cell", "certificate", "verify",
                                           "versions", "proposals", "activate", "compare"),
                         [](const auto& one) {
                           std::string name = one.param;
                           std::replace(name.begin(), name.end(), '-', '_');
                           return name;
                         });

TEST(Cellcal, IsUsedWronglyWithoutACommandOrWithOneThatDoesNotExist) {
  EXPECT_EQ(run_program({CELLCAL}).status, 2);
  EXPECT_EQ(run_program({CELLCAL, "calibrate"}).status, 2);
  EXPECT_EQ(run_program({CELLCAL, "run"}).status, 2) << "--cell or --resume is needed";
  EXPECT_EQ(run_program({CELLCAL, "run", "--cell", "c", "--touches", "1"}).status, 2);
  EXPECT_EQ(run_program({CELLCAL, "show", "zero"}).status, 2);
  for (const char* comma : {"21,5", "warm"}) {
    const Outcome refused = run_program({CELLCAL, "check", "--temperature", comma});
    EXPECT_EQ(refused.status, 2);
    EXPECT_NE(refused.err.find("is not a number (use a decimal point)"), std::string::npos)
        << refused.err;
  }
  EXPECT_NE(run_program({CELLCAL, "check", "--temperature", "99"})
                .err.find("99 is not between -40 and 80"),
            std::string::npos);
  EXPECT_EQ(run_program({CELLCAL, "identify", "--cell", "c"}).status, 2);
}

TEST(Cellcal, NamesWhatIsNoSessionsNumber) {
  for (const char* number : {"abc", "0", "-1", "1.5", "9223372036854775808"})
    for (const char* command : {"show", "report"}) {
      const Outcome refused = run_program({CELLCAL, command, "--", number});
      EXPECT_EQ(refused.status, 2);
      EXPECT_EQ(refused.err,
                std::string("cellcal ") + command + ": ID: \"" + number +
                    "\" must be a session's number, a whole one from 1\nsee 'cellcal " + command +
                    " --help'\n");
    }
}

TEST(Cellcal, NamesTheCommandsThereAreWhereOneBelowAnotherDoesNotExist) {
  const Outcome unknown = run_program({CELLCAL, "token", "lst"});
  EXPECT_EQ(unknown.status, 2);
  EXPECT_EQ(unknown.out, "");
  EXPECT_EQ(unknown.err.find("cellcal: unknown command \"token lst\". Did you mean \"list\"? The "
                             "commands: "),
            0u)
      << unknown.err;
  EXPECT_NE(unknown.err.find("see 'cellcal token --help'\n"), std::string::npos) << unknown.err;
  for (const char* name : {"fleet", "priors", "token"}) {
    const Outcome other = run_program({CELLCAL, name, "no-such-command"});
    EXPECT_EQ(other.status, 2);
    EXPECT_EQ(
        other.err.find(std::string("cellcal: unknown command \"") + name + " no-such-command\"."),
        0u)
        << other.err;
    const Outcome none = run_program({CELLCAL, name});
    EXPECT_EQ(none.status, 2);
    EXPECT_EQ(
        none.err.find(std::string("cellcal: no command given after \"") + name + "\"; commands: "),
        0u)
        << none.err;
  }
}

TEST(Cellcal, ListsItsCommandsAndItsVersion) {
  const Outcome help = run_program({CELLCAL, "--help"});
  EXPECT_EQ(help.status, 0);
  for (const char* name : {"identify", "predict", "plan", "run", "status", "watch", "abort"}) {
    EXPECT_NE(help.out.find(name), std::string::npos) << name;
  }
  EXPECT_EQ(run_program({CELLCAL, "--version"}).status, 0);
}

class EveryClientCommand : public ::testing::TestWithParam<std::vector<std::string>> {};

TEST_P(EveryClientCommand, FailsInOneLineWithoutADaemon) {
  std::vector<std::string> arguments{CELLCAL};
  for (const std::string& one : GetParam()) arguments.push_back(one);
  arguments.insert(arguments.end(), {"--socket", "/nonexistent/cellcald.sock"});
  const Outcome outcome = run_program(arguments);
  EXPECT_EQ(outcome.status, 1);
  EXPECT_EQ(outcome.out, "");
  EXPECT_TRUE(outcome.err.starts_with("cellcal " + GetParam().front())) << outcome.err;
  EXPECT_NE(outcome.err.find(": no cellcald answers on /nonexistent/cellcald.sock"),
            std::string::npos)
      << outcome.err;
  EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1);
}

TEST_P(EveryClientCommand, TakesWhatAllHaveInFrontOfItAsWell) {
  std::vector<std::string> arguments{CELLCAL, "--json", "--socket", "/nonexistent/cellcald.sock"};
  for (const std::string& one : GetParam()) arguments.push_back(one);
  const Outcome outcome = run_program(arguments);
  EXPECT_EQ(outcome.status, 1);
  EXPECT_NE(outcome.err.find("no cellcald answers on /nonexistent/cellcald.sock"),
            std::string::npos)
      << outcome.err;
}

TEST(Cellcal, SaysInTheReadersLanguageThatNoDaemonAnswersAndThatTheArmMayMove) {
  const Outcome outcome =
      run_program({CELLCAL, "--language", "de", "--socket", "/nonexistent/s", "abort"});
  EXPECT_EQ(outcome.status, 1);
  EXPECT_EQ(outcome.err.find("cellcal abort: kein cellcald antwortet auf /nonexistent/s ("), 0u)
      << outcome.err;
  EXPECT_NE(outcome.err.find("Der Arm bewegt sich vielleicht: Not-Halt drücken"), std::string::npos)
      << outcome.err;
}

TEST(Cellcal, NamesTheValuesThatAnOptionTakes) {
  EXPECT_EQ(run_program({CELLCAL, "status", "--language", "fr"}).err,
            "cellcal status: --language: \"fr\" is none of de, en\n"
            "see 'cellcal status --help'\n");
  EXPECT_NE(run_program({CELLCAL, "run", "--cell", "c", "--goal", "0"})
                .err.find("--goal: 0 is not between 0.01 and 10\n"),
            std::string::npos);
  EXPECT_NE(run_program({CELLCAL, "run", "--cell", "c", "--touches", "4.5"})
                .err.find("--touches: 4.5 is not a whole number\n"),
            std::string::npos);
}

TEST(Cellcal, RefusesAnOptionInFrontOfACommandThatHasNoneSuch) {
  const Outcome refused = run_program({CELLCAL, "--socket=/s", "robots"});
  EXPECT_EQ(refused.status, 2);
  EXPECT_EQ(refused.err.find("cellcal robots: unknown option \"--socket"), 0u) << refused.err;
  const Outcome unknown = run_program({CELLCAL, "--socket", "/s", "fnd"});
  EXPECT_EQ(unknown.status, 2);
  EXPECT_EQ(unknown.err.find("cellcal: unknown command \"fnd\". Did you mean \"find\"?"), 0u)
      << unknown.err;
  EXPECT_EQ(run_program({CELLCAL, "--socket", "/nowhere/f.sock", "fleet", "status"}).status, 1);
}

INSTANTIATE_TEST_SUITE_P(
    Cli, EveryClientCommand,
    ::testing::Values(std::vector<std::string>{"run", "--cell", "c.toml"},
                      std::vector<std::string>{"run", "--resume"},
                      std::vector<std::string>{"status"}, std::vector<std::string>{"watch"},
                      std::vector<std::string>{"abort"}, std::vector<std::string>{"history"},
                      std::vector<std::string>{"show", "1"}, std::vector<std::string>{"report"},
                      std::vector<std::string>{"token", "list"},
                      std::vector<std::string>{"token", "remove", "a"},
                      std::vector<std::string>{"token", "add", "--role", "look", "--name", "a"}));

}  // namespace
}  // namespace cellcal::daemon::testing
