#include <gtest/gtest.h>

#include "daemon/config/config.h"
#include "daemon/config/unattended_config.h"
#include "tests/daemon/config/reason.h"

namespace cellcal::daemon {
namespace {

const std::string kNotify =
    "format = \"cellcal.daemon/1\"\nbackend = \"rsi\"\n[contact]\ndevice = \"/dev/x\"\n[notify]\n";

NotifyConfig notify_of(const std::string& text) {
  return parse_config(kNotify + text, "d.toml").notify;
}

std::string refusal_of_notify(const std::string& text) { return testing::reason(kNotify + text); }

WebhookUrl url(const std::string& text) {
  return notify_of("webhook = \"" + text + "\"\n").webhook->url;
}

TEST(WhoIsTold, IsNobodyUnlessItIsConfigured) {
  EXPECT_EQ(notify_of(""), NotifyConfig{});
  EXPECT_FALSE(notify_of("language = \"de\"\n").webhook);
}

TEST(TheLanguage, OfMessagesIsTheTopLevelOneUnlessAnotherIsStated) {
  const std::string german =
      "format = \"cellcal.daemon/1\"\nbackend = \"rsi\"\nlanguage = \"de\"\n"
      "[contact]\ndevice = \"/dev/x\"\n";
  EXPECT_EQ(parse_config(german, "d.toml").language.code(), "de");
  EXPECT_EQ(parse_config(german, "d.toml").notify.language.code(), "de");
  EXPECT_EQ(parse_config(german + "[notify]\nlanguage = \"en\"\n", "d.toml").notify.language.code(),
            "en");
  const std::string refusal = refusal_of_notify("language = \"klingon\"\n");
  EXPECT_NE(refusal.find("d.toml:6"), std::string::npos) << refusal;
  EXPECT_NE(refusal.find("use one of \"de\", \"en\""), std::string::npos) << refusal;
}

TEST(AnAddressForPost, IsTakenApart) {
  EXPECT_EQ(url("https://hooks.plant.example/cellcal?a=b"),
            (WebhookUrl{true, "hooks.plant.example", "443", "/cellcal?a=b"}));
  EXPECT_EQ(url("http://10.0.0.7:8080"), (WebhookUrl{false, "10.0.0.7", "8080", "/"}));
  EXPECT_EQ(url("https://[fd00::1]:8443?x"), (WebhookUrl{true, "fd00::1", "8443", "/?x"}));
}

TEST(AnAddressForPost, ThatIsNoneIsRefusedWithItsLine) {
  for (const char* wrong :
       {"", "ftp://a/b", "https://", "http:///x", "http://a:0/", "http://a:70000/", "http://a:b/",
        "http://user@a/", "http://a/#x", "http://a b/", "http://[::1/", "http://a/\\r\\nHost: b",
        "http://a:1:2/", "https://ä.example/"}) {
    EXPECT_NE(refusal_of_notify("webhook = \"" + std::string(wrong) + "\"\n").find("d.toml:6"),
              std::string::npos)
        << wrong;
  }
  EXPECT_NE(refusal_of_notify("webhook = \"http://a/" + std::string(3000, 'x') + "\"\n"),
            "accepted");
}

TEST(AMailAddress, ThatCouldBeAnotherWordOrLineIsRefused) {
  EXPECT_EQ(notify_of("mail_to = [\"a@b.example\"]\n").mail->from, "cellcal@localhost");
  for (const char* wrong :
       {"", "a", "@b", "a@", "-f@b", "a@b,c@d", "a@b\\nBcc: c@d", "a b@c", "<a@b>", "a@b@c"}) {
    EXPECT_NE(refusal_of_notify("mail_to = [\"" + std::string(wrong) + "\"]\n").find("mail_to"),
              std::string::npos)
        << wrong;
    EXPECT_NE(refusal_of_notify("mail_to = [\"a@b\"]\nmail_from = \"" + std::string(wrong) + "\"\n")
                  .find("mail_from"),
              std::string::npos)
        << wrong;
  }
  EXPECT_NE(refusal_of_notify("mail_to = []\n"), "accepted");
}

TEST(AMailServer, IsReadWithItsUsualPortAndAUserGoesOverTlsAlone) {
  const std::string to = "mail_to = [\"a@b.example\"]\n";
  const MailServer relay = *notify_of(to + "mail_server = \"smtp://relay\"\n").mail->server;
  EXPECT_EQ(relay.port, "25");
  EXPECT_FALSE(relay.tls || relay.starttls);
  const std::string user = "mail_user = \"cell7\"\nmail_password_file = \"/p\"\n";
  const MailServer submission =
      *notify_of(to + user + "mail_server = \"smtp://[fe80::1]\"\n").mail->server;
  EXPECT_EQ(submission.port, "587");
  EXPECT_EQ(submission.host, "fe80::1");
  EXPECT_TRUE(submission.starttls);
  const MailServer tls =
      *notify_of(to + user + "mail_server = \"smtps://mail.example:4465\"\nmail_ca = \"/c\"\n")
           .mail->server;
  EXPECT_TRUE(tls.tls && !tls.starttls);
  EXPECT_EQ(tls.port, "4465");
  for (const char* wrong :
       {"mail.example", "http://mail.example", "smtp://", "smtp://a:b", "smtp://a:0", "smtp://u@a",
        "smtp://a/path", "smtp://a b", "smtp://a\\r\\nx"}) {
    EXPECT_NE(refusal_of_notify(to + "mail_server = \"" + wrong + "\"\n").find("mail_server"),
              std::string::npos)
        << wrong;
  }
  const std::string plain = to + "mail_server = \"smtp://relay\"\n";
  EXPECT_NE(refusal_of_notify(plain + user + "mail_starttls = false\n").find("mail_starttls"),
            std::string::npos);
  EXPECT_NE(refusal_of_notify(plain + "mail_ca = \"/c\"\n").find("mail_ca"), std::string::npos);
  EXPECT_NE(refusal_of_notify(plain + "mail_user = \"x\"\n").find("mail_password_file"),
            std::string::npos);
  EXPECT_NE(refusal_of_notify(plain + "mail_password_file = \"/x\"\n").find("mail_user"),
            std::string::npos);
  EXPECT_NE(refusal_of_notify(to + "mail_user = \"x\"\n").find("mail_server"), std::string::npos);
  EXPECT_NE(refusal_of_notify(to + "mail_server = \"smtps://a\"\nmail_starttls = true\n")
                .find("mail_starttls"),
            std::string::npos);
}

TEST(WhatMeansNothingAlone, IsRefusedAndNamed) {
  EXPECT_NE(refusal_of_notify("webhook_retries = 3\n").find("without webhook"), std::string::npos);
  EXPECT_NE(refusal_of_notify("sendmail = \"/x\"\n").find("without mail_to"), std::string::npos);
  EXPECT_NE(refusal_of_notify("webhook = \"http://a/\"\nwebhook_ca = \"/x\"\n").find("webhook_ca"),
            std::string::npos);
  EXPECT_NE(
      refusal_of_notify("webhook = \"http://a/\"\nwebhook_retries = 11\n").find("webhook_retries"),
      std::string::npos);
}

}  // namespace
}  // namespace cellcal::daemon
