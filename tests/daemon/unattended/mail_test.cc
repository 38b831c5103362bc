// Mail through a program that stores its input.

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <csignal>
#include <fstream>
#include <sstream>

#include "daemon/unattended/transfer.h"
#include "tests/daemon/journal/temporary_directory.h"

namespace cellcal::daemon {
namespace {

std::string content(const std::filesystem::path& path) {
  std::ifstream file(path);
  std::stringstream text;
  text << file.rdbuf();
  return text.str();
}

struct AMail : ::testing::Test {
  /// As in the daemon: a program that reads nothing causes an error code.
  AMail() { std::signal(SIGPIPE, SIG_IGN); }
  /// A shell script in place of sendmail.
  void program(const std::string& script) {
    std::ofstream(dir / "sendmail") << "#!/bin/sh\n" << script << "\n";
    ::chmod((dir / "sendmail").c_str(), 0755);
  }
  MailConfig config() const {
    return {{"a@plant.example", "b@plant.example"}, "cellcal@cell7", dir / "sendmail", {}};
  }
  testing::TemporaryDirectory dir;
};

TEST_F(AMail, ReachesTheSystemsProgramWholeWithItsAddressesAndNoDescriptorButItsOwn) {
  program("for a in \"$@\"; do echo \"$a\"; done > '" + (dir / "words").string() + "'\ncat > '" +
          (dir / "mail").string() + "'\nls /proc/self/fd | wc -l > '" + (dir / "open").string() +
          "'\nenv > '" + (dir / "env").string() + "'");
  const std::ofstream another(dir / "held open");
  std::string body;
  for (int i = 0; i < 20000; ++i) body += "Zeile für Zeile\n";
  const std::string mail = mail_text(config(), {"Sitzung 7: für dich", body, ""}, "date", "1d");
  const Delivery result = send_mail(config(), mail);
  EXPECT_TRUE(result.delivered) << result.why;
  EXPECT_EQ(content(dir / "mail"), mail);
  EXPECT_EQ(content(dir / "words"),
            "-i\n-f\ncellcal@cell7\n--\na@plant.example\nb@plant.example\n");
  EXPECT_EQ(std::stoi(content(dir / "open")), 4) << "in, out, error, and that of ls itself";
  EXPECT_EQ(content(dir / "env").find("HOME"), std::string::npos);
}

TEST_F(AMail, HasAHeadOfAsciiAndLinesThatEveryServerTakes) {
  const std::string mail =
      mail_text(config(),
                {"Sitzung 7: Ergebnis zurückgehalten, lang und noch länger, bis zur nächsten Zeile",
                 std::string(500, 'x') + " ü=\n.\n", ""},
                "Sun, 22 Nov 2026 22:00:00 +0000", "1d");
  for (const char c : mail) EXPECT_TRUE(c == '\n' || (' ' <= c && c <= '~')) << static_cast<int>(c);
  std::string line;
  for (std::istringstream lines(mail); std::getline(lines, line);)
    EXPECT_LE(line.size(), 100u) << line;
  EXPECT_NE(mail.find("Subject: =?utf-8?Q?Sitzung_7=3A_"), std::string::npos) << mail;
  EXPECT_NE(mail.find("zur=C3=BCckgehalten"), std::string::npos) << mail;
  EXPECT_NE(mail.find("=3D\n"), std::string::npos) << mail;
  EXPECT_NE(mail.find("\n=2E"), std::string::npos) << mail;
  EXPECT_NE(mail.find("\nMessage-ID: <1d@cell7>\n"), std::string::npos) << mail;
  EXPECT_NE(mail.find("To: a@plant.example,\n b@plant.example\n"), std::string::npos) << mail;
}

TEST_F(AMail, ThatTheProgramRefusesIsTriedAgainOnlyWhereItSaysSo) {
  program("exit 75");
  EXPECT_TRUE(send_mail(config(), "m").again);
  program("exit 64");
  const Delivery refused = send_mail(config(), "m");
  EXPECT_FALSE(refused.delivered || refused.again);
  EXPECT_NE(refused.why.find("status 64"), std::string::npos) << refused.why;
  MailConfig none = config();
  none.program = dir / "none";
  EXPECT_NE(send_mail(none, "m").why.find("No such file"), std::string::npos);
}

TEST_F(AMail, WhoseProgramHangsOrReadsNothingIsGivenUpAndLeavesNoChild) {
  program("exec sleep 1000");
  const Delivery hung =
      send_mail(config(), std::string(1 << 20, 'x'), std::chrono::milliseconds(100));
  EXPECT_FALSE(hung.delivered);
  EXPECT_NE(hung.why.find("did not end in time"), std::string::npos) << hung.why;
}

}  // namespace
}  // namespace cellcal::daemon
