#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cstdlib>
#include <fstream>

#include "daemon/unattended/transfer.h"
#include "tests/daemon/journal/temporary_directory.h"
#include "tests/daemon/unattended/hook_server.h"

namespace cellcal::daemon {
namespace {

using testing::HookServer;

WebhookConfig to(const HookServer& server) {
  WebhookConfig config;
  config.url = {false, "127.0.0.1", server.port(), "/in?cell=7"};
  return config;
}

TEST(AWebhook, IsPostedAsJsonWithItsSecret) {
  HookServer server({testing::kTaken});
  const Delivery result = post(to(server), "s3cret", R"({"a": 1})");
  EXPECT_TRUE(result.delivered) << result.why;
  ASSERT_EQ(server.requests().size(), 1u);
  const std::string request = server.requests()[0];
  EXPECT_EQ(request.rfind("POST /in?cell=7 HTTP/1.1\r\n", 0), 0u) << request;
  EXPECT_NE(request.find("\r\nX-Cellcal-Secret: s3cret\r\n"), std::string::npos) << request;
  EXPECT_NE(request.find("\r\nContent-Type: application/json\r\n"), std::string::npos) << request;
  EXPECT_NE(request.find("\r\nHost: 127.0.0.1:" + server.port()), std::string::npos) << request;
  EXPECT_TRUE(request.ends_with("\r\n\r\n{\"a\": 1}")) << request;
}

TEST(AWebhook, MayBeTriedAgainWhereTheServerIsBusyAndNotWhereItRefuses) {
  HookServer busy({testing::kBroken}), refusing({testing::kRefused}),
      elsewhere(
          {"HTTP/1.1 302 Found\r\nLocation: http://127.0.0.1:1/\r\nContent-Length: 0\r\n\r\n"});
  EXPECT_TRUE(post(to(busy), "", "{}").again);
  EXPECT_FALSE(post(to(refusing), "", "{}").again);
  const Delivery redirected = post(to(elsewhere), "", "{}");
  EXPECT_FALSE(redirected.delivered || redirected.again);
  EXPECT_EQ(elsewhere.requests()[0].find("X-Cellcal-Secret"), std::string::npos);
}

TEST(AWebhook, ThatNobodyAnswersOrAnswersWithNonsenseIsGivenUpInItsTime) {
  HookServer silent({""}), odd({"220 mail.example ESMTP\r\n"}),
      endless({"HTTP/1.1 200 OK\r\nContent-Length: 99999999\r\n\r\nx"});
  WebhookConfig config = to(silent);
  config.timeout_s = 0.2;
  const Delivery late = post(config, "", "{}");
  EXPECT_TRUE(!late.delivered && late.again) << late.why;
  EXPECT_NE(late.why.find("no answer within"), std::string::npos) << late.why;
  EXPECT_FALSE(post(to(odd), "", "{}").delivered);
  EXPECT_FALSE(post(to(endless), "", "{}").delivered);
  config.url.port = "1";
  EXPECT_NE(post(config, "", "{}").why.find("cannot connect"), std::string::npos);
}

struct AWebhookOverTls : ::testing::Test {
  testing::SelfSigned self_signed;
};

TEST_F(AWebhookOverTls, IsSentToAServerWhoseCertificateAndNameAreRightAndToNoOther) {
  HookServer server({testing::kTaken}, self_signed.context());
  WebhookConfig config = to(server);
  config.url.tls = true;
  config.url.host = "localhost";
  config.ca = self_signed.certificate();
  const Delivery known = post(config, "s3cret", "{}");
  EXPECT_TRUE(known.delivered) << known.why;
  EXPECT_EQ(server.requests().size(), 1u);
  config.url.host = "127.0.0.1";
  EXPECT_FALSE(post(config, "s3cret", "{}").delivered) << "another name";
  config.url.host = "localhost";
  config.ca.clear();
  const Delivery unknown = post(config, "s3cret", "{}");
  EXPECT_FALSE(unknown.delivered) << "unknown authority";
  EXPECT_NE(unknown.why.find("TLS"), std::string::npos) << unknown.why;
  // In TLS 1.3 the server completes before the client has checked the name.
  for (std::size_t i = 1; i < server.requests().size(); ++i)
    EXPECT_EQ(server.requests()[i], "") << "and no secret was sent";
}

std::string refusal(const std::filesystem::path& file) {
  try {
    read_secret(file);
    return "taken";
  } catch (const std::runtime_error& error) {
    return error.what();
  }
}

TEST(ASecret, IsTheFilesFirstLineAndNobodysWhoMayNotReadIt) {
  const testing::TemporaryDirectory dir;
  EXPECT_EQ(read_secret({}), "");
  EXPECT_NE(refusal(dir / "s").find("missing"), std::string::npos);
  std::ofstream(dir / "s") << "abc-123\nmore\n";
  ::chmod((dir / "s").c_str(), 0644);
  EXPECT_NE(refusal(dir / "s").find("readable by every user"), std::string::npos);
  ::chmod((dir / "s").c_str(), 0640);
  EXPECT_EQ(read_secret(dir / "s"), "abc-123");
  for (const char* wrong : {"", "two words", "tab\t", "a\r"}) {
    std::ofstream(dir / "s") << wrong << "\n";
    EXPECT_NE(refusal(dir / "s").find("visible ASCII"), std::string::npos) << wrong;
  }
}

}  // namespace
}  // namespace cellcal::daemon
