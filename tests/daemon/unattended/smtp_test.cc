#include <gtest/gtest.h>

#include <cstdlib>

#include "daemon/unattended/transfer.h"
#include "tests/daemon/journal/temporary_directory.h"
#include "tests/daemon/unattended/smtp_server.h"

namespace cellcal::daemon {
namespace {

using testing::SmtpServer;

const MailConfig kMail{{"a@plant.example", "b@plant.example"}, "cellcal@cell7", "", {}};

MailServer at(const SmtpServer& server) {
  MailServer config;
  config.host = "127.0.0.1";
  config.port = server.port();
  return config;
}

TEST(AMailForAServer, ArrivesWholeWithItsAddresses) {
  SmtpServer server({});
  const Delivery result =
      send_by_smtp(kMail, at(server), "", "Subject: x\n\nfirst\n.\n.second\nlast\n");
  EXPECT_TRUE(result.delivered) << result.why;
  EXPECT_EQ(result.why, "");
  const std::vector<std::string> lines = server.lines();
  const std::vector<std::string> expected{"MAIL FROM:<cellcal@cell7>",
                                          "RCPT TO:<a@plant.example>",
                                          "RCPT TO:<b@plant.example>",
                                          "DATA",
                                          "Subject: x",
                                          "",
                                          "first",
                                          "..",
                                          "..second",
                                          "last",
                                          ".",
                                          "QUIT"};
  ASSERT_GT(lines.size(), expected.size());
  EXPECT_EQ(std::vector<std::string>(lines.begin() + 1, lines.end()), expected);
}

TEST(AMailForAServer, ReachesThoseThatItTakesAndSaysOfWhomItDoesNot) {
  SmtpServer one({.answers = {{"RCPT TO:<a@", "550 no such user"}}});
  const Delivery some = send_by_smtp(kMail, at(one), "", "m\n");
  EXPECT_TRUE(some.delivered) << some.why;
  EXPECT_FALSE(some.again);
  EXPECT_NE(some.why.find("not to 1 of the addresses: 550 no such user"), std::string::npos)
      << some.why;
  SmtpServer none({.answers = {{"RCPT", "550 relaying denied"}}});
  const Delivery refused = send_by_smtp(kMail, at(none), "", "m\n");
  EXPECT_FALSE(refused.delivered || refused.again);
  EXPECT_NE(refused.why.find("550"), std::string::npos) << refused.why;
}

TEST(AMailForAServer, IsToBeTriedAgainForThoseAloneThatAreBusy) {
  SmtpServer one({.answers = {{"RCPT TO:<a@", "451 busy"}}}),
      both({.answers = {{"RCPT TO:<a@", "450 busy"}, {"RCPT TO:<b@", "550 no such user"}}}),
      lost({.answers = {{"RCPT TO:<a@", "550 no such user"}, {".", "451 later"}}});
  const std::vector<std::string> a{"a@plant.example"}, b{"b@plant.example"};
  const Delivery some = send_by_smtp(kMail, at(one), "", "m\n");
  EXPECT_TRUE(some.delivered && some.again) << some.why;
  EXPECT_EQ(some.left, a);
  EXPECT_NE(some.why.find("not to 1 of the addresses: 451 busy"), std::string::npos) << some.why;
  const Delivery none = send_by_smtp(kMail, at(both), "", "m\n");
  EXPECT_TRUE(!none.delivered && none.again) << none.why;
  EXPECT_EQ(none.left, a) << "the other one will never take it";
  const Delivery later = send_by_smtp(kMail, at(lost), "", "m\n");
  EXPECT_TRUE(!later.delivered && later.again) << later.why;
  EXPECT_EQ(later.left, b);
}

TEST(AMailForAServer, ThatIsBusyOrGoneIsTriedAgainAndOneThatIsRefusedIsNot) {
  SmtpServer busy({.answers = {{"MAIL", "451 later"}}}),
      full({.answers = {{".", "552 too large"}}}),
      odd({.answers = {{"EHLO", "HTTP/1.1 200 OK"}, {"HELO", "HTTP/1.1 200 OK"}}});
  EXPECT_TRUE(send_by_smtp(kMail, at(busy), "", "m\n").again);
  const Delivery refused = send_by_smtp(kMail, at(full), "", "m\n");
  EXPECT_FALSE(refused.delivered || refused.again) << refused.why;
  MailServer strange = at(odd);
  strange.timeout_s = 0.2;
  EXPECT_FALSE(send_by_smtp(kMail, strange, "", "m\n").delivered);
  MailServer gone = at(busy);
  gone.port = "1";
  const Delivery lost = send_by_smtp(kMail, gone, "", "m\n");
  EXPECT_TRUE(lost.again);
  EXPECT_NE(lost.why.find("cannot connect"), std::string::npos) << lost.why;
}

struct AMailOverTls : ::testing::Test {
  MailServer known(const SmtpServer& server) const {
    MailServer config = at(server);
    config.host = "localhost";
    config.user = "cell7";
    config.ca = self_signed.certificate();
    return config;
  }

  testing::SelfSigned self_signed;
};

TEST_F(AMailOverTls, SaysNothingButItsGreetingBeforeTlsAndThenWhoItIs) {
  SmtpServer server({.tls = self_signed.context()});
  MailServer config = known(server);
  config.starttls = true;
  const Delivery result = send_by_smtp(kMail, config, "s3cret", "m\n");
  EXPECT_TRUE(result.delivered) << result.why;
  for (const std::string& line : server.lines())
    EXPECT_TRUE(line.starts_with("tls ") || line.starts_with("EHLO") || line == "STARTTLS") << line;
  // "\0cell7\0s3cret" in base64.
  bool named = false;
  for (const std::string& line : server.lines())
    named = named || line.find("AGNlbGw3AHMzY3JldA==") != std::string::npos;
  EXPECT_TRUE(named);
  EXPECT_TRUE(server.heard("tls RCPT TO:<b@plant.example>"));
}

TEST_F(AMailOverTls, IsSpokenFromTheFirstByteToAServerThatWantsItSo) {
  SmtpServer server({.tls = self_signed.context(), .from_the_first_byte = true});
  MailServer config = known(server);
  config.tls = true;
  const Delivery result = send_by_smtp(kMail, config, "s3cret", "m\n");
  EXPECT_TRUE(result.delivered) << result.why;
  EXPECT_TRUE(server.heard("tls DATA"));
}

TEST_F(AMailOverTls, KeepsItsPasswordFromAServerWithoutTlsOrWithAnotherName) {
  SmtpServer plain({}), other({.tls = self_signed.context()}),
      refusing({.tls = self_signed.context(), .answers = {{"AUTH", "535 who are you"}}});
  for (SmtpServer* server : {&plain, &other}) {
    MailServer config = known(*server);
    config.starttls = true;
    if (server == &other) config.host = "127.0.0.1";
    const Delivery result = send_by_smtp(kMail, config, "s3cret", "m\n");
    EXPECT_FALSE(result.delivered);
    EXPECT_NE(result.why.find("TLS"), std::string::npos) << result.why;
    for (const std::string& line : server->lines())
      EXPECT_EQ(line.find("AUTH"), std::string::npos) << line;
  }
  MailServer config = known(refusing);
  config.starttls = true;
  const Delivery denied = send_by_smtp(kMail, config, "wrong", "m\n");
  EXPECT_FALSE(denied.delivered || denied.again);
  EXPECT_NE(denied.why.find("user or password refused"), std::string::npos) << denied.why;
}

}  // namespace
}  // namespace cellcal::daemon
