// A tree of commands, and the resulting man page and completions.

#include <gtest/gtest.h>

#include <CLI/CLI.hpp>

#include "daemon/manual/man_page.h"

namespace cellcal::daemon {
namespace {

class Manual : public ::testing::Test {
 protected:
  Manual() {
    app_.name("tool");
    app_.description("Does a thing.");
    app_.footer("Example: cellcal tool");
    CLI::App* command = app_.add_subcommand("do", "Do it: 'now'");
    command->footer("First\nsecond.\nExample: cellcal do --how slow\n         cellcal do 7");
    command->add_option("ID", id_, "Number")->required();
    command->add_option("-w,--how", how_, "How [slow]")->check(CLI::IsMember({"slow", "fast"}));
    command->add_option("--share", share_, "Share")->check(CLI::Range(1, 9))->capture_default_str();
    command->add_flag("--json", json_, "Print \\JSON");
  }
  CommandHelp tree() const { return command_tree(app_); }

  int id_ = 0, share_ = 3;
  std::string how_;
  bool json_ = false;
  CLI::App app_;
};

TEST_F(Manual, HasOfACommandWhatItsHelpHas) {
  const CommandHelp program = tree();
  ASSERT_EQ(program.commands.size(), 1u);
  const CommandHelp& command = program.commands[0];
  EXPECT_EQ(command.remarks, "First second.");
  EXPECT_EQ(command.examples, (std::vector<std::string>{"cellcal do --how slow", "cellcal do 7"}));
  ASSERT_EQ(command.options.size(), 5u);  // with --help
  EXPECT_EQ(command.options[1].place, "ID");
  EXPECT_TRUE(command.options[1].required);
  EXPECT_EQ(command.options[2].flags, (std::vector<std::string>{"-w", "--how"}));
  EXPECT_EQ(command.options[2].value, "TEXT");
  EXPECT_EQ(command.options[2].choices, (std::vector<std::string>{"slow", "fast"}));
  EXPECT_EQ(command.options[3].range, "1 - 9");
  EXPECT_EQ(command.options[3].usual, "3");
  EXPECT_TRUE(command.options[4].value.empty());
}

TEST_F(Manual, ShowsWhatRoffWouldTakeForItsOwn) {
  CommandHelp help = tree();
  help.words = ".so /etc/passwd\n'br \\fI";
  const std::string page = man_page({help, 1, "1.0", {}, {}});
  EXPECT_EQ(page.find("\n.so"), std::string::npos);
  EXPECT_EQ(page.find("\n'br"), std::string::npos);
  EXPECT_NE(page.find("\\&.so /etc/passwd"), std::string::npos) << page;
  EXPECT_NE(page.find("\\efI"), std::string::npos) << page;
}

TEST_F(Manual, HasAPartForEachCommandWithinACommand) {
  CommandHelp help = tree();
  CommandHelp inner = help.commands[0];
  inner.name = "again";
  help.commands[0].commands.push_back(inner);
  const std::string page = man_page({help, 1, "1.0", {}, {}});
  const std::size_t part = page.find(".SS tool do again\n");
  ASSERT_NE(part, std::string::npos) << page;
  EXPECT_NE(page.find("\\-\\-share", part), std::string::npos) << page;
}

TEST_F(Manual, LetsNoWordOfHelpRunInAShell) {
  CommandHelp help = tree();
  help.commands[0].words = "it's $(reboot) `reboot` [x]: \\";
  help.commands[0].options[2].words = "that's '$(reboot)' [y] \\";
  // In single quotes throughout; a quote in the text ends, escapes and reopens them.
  EXPECT_NE(zsh_completion(help).find("'do:it'\\''s $(reboot) `reboot` [x]: \\\\'"),
            std::string::npos)
      << zsh_completion(help);
  EXPECT_NE(fish_completion(help).find("-d 'it\\'s $(reboot) `reboot` [x]: \\\\'"),
            std::string::npos)
      << fish_completion(help);
  EXPECT_EQ(bash_completion(help).find("reboot"), std::string::npos);
}

}  // namespace
}  // namespace cellcal::daemon
