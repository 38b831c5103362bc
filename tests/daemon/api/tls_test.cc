// TLS, with a certificate created by the test.

#include <gtest/gtest.h>

#include <boost/asio/connect.hpp>
#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/read.hpp>
#include <boost/asio/ssl.hpp>
#include <boost/asio/write.hpp>
#include <cstdlib>
#include <fstream>
#include <thread>

#include "daemon/api/http/server.h"
#include "tests/daemon/api/tcp_peer.h"
#include "tests/daemon/journal/temporary_directory.h"

namespace cellcal::daemon {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;
using testing::TcpPeer;

constexpr const char* kEllipticKey = "ec -pkeyopt ec_paramgen_curve:prime256v1";

void make_certificate(const std::filesystem::path& certificate, const std::filesystem::path& key,
                      const std::string& kind = kEllipticKey) {
  const std::string command = "openssl req -x509 -newkey " + kind +
                              " -nodes -days 2 "
                              "-subj /CN=localhost -addext subjectAltName=DNS:localhost -out " +
                              certificate.string() + " -keyout " + key.string() + " 2>/dev/null";
  ASSERT_EQ(std::system(command.c_str()), 0) << command;
}

struct ATlsServer : ::testing::Test {
  void serve(ServerLimits limits = {}, const std::string& key = kEllipticKey) {
    make_certificate(dir / "c.pem", dir / "k.pem", key);
    server = std::make_unique<HttpServer>(
        context, NetworkAddress{"127.0.0.1", 0, dir / "c.pem", dir / "k.pem"},
        ServerParts{[](Request&) { return std::nullopt; },
                    [](const Request& request, bool) {
                      return Response{200, "text/plain", "secret of " + request.path};
                    },
                    {},
                    limits});
    thread = std::thread([this] { context.run(); });
  }
  ~ATlsServer() override {
    if (!server) return;
    asio::post(context, [this] {
      server->stop();
      work.reset();
    });
    thread.join();
  }

  std::string get(asio::ssl::context& client) {
    asio::io_context own;
    asio::ssl::stream<tcp::socket> stream(own, client);
    stream.lowest_layer().connect({asio::ip::address_v4::loopback(), server->port()});
    stream.set_verify_mode(asio::ssl::verify_peer);
    stream.set_verify_callback(asio::ssl::host_name_verification("localhost"));
    stream.handshake(asio::ssl::stream_base::client);
    asio::write(stream, asio::buffer(std::string("GET /a HTTP/1.1\r\nHost: localhost\r\n"
                                                 "Connection: close\r\n\r\n")));
    std::string answer;
    boost::system::error_code end;
    asio::read(stream, asio::dynamic_buffer(answer), end);
    EXPECT_EQ(end, asio::error::eof) << "it has to say goodbye";
    return answer;
  }

  testing::TemporaryDirectory dir;
  asio::io_context context;
  asio::executor_work_guard<asio::io_context::executor_type> work{context.get_executor()};
  std::unique_ptr<HttpServer> server;
  std::thread thread;
};

TEST_F(ATlsServer, AnswersThoseWhoKnowItsCertificate) {
  serve();
  asio::ssl::context client(asio::ssl::context::tls_client);
  client.load_verify_file(dir / "c.pem");
  const std::string answer = get(client);
  EXPECT_EQ(answer.rfind("HTTP/1.1 200", 0), 0u) << answer;
  EXPECT_NE(answer.find("secret of /a"), std::string::npos) << answer;
}

TEST_F(ATlsServer, ServesARenewedCertificateFromTheNextConnectionOn) {
  serve();
  asio::ssl::context former(asio::ssl::context::tls_client);
  former.load_verify_file(dir / "c.pem");
  make_certificate(dir / "new.pem", dir / "new_key.pem");
  asio::ssl::context renewed(asio::ssl::context::tls_client);
  renewed.load_verify_file(dir / "new.pem");
  std::filesystem::rename(dir / "new.pem", dir / "c.pem");
  EXPECT_EQ(get(former).rfind("HTTP/1.1 200", 0), 0u) << "its key is still the former one";
  std::filesystem::rename(dir / "new_key.pem", dir / "k.pem");
  EXPECT_EQ(get(renewed).rfind("HTTP/1.1 200", 0), 0u);
}

TEST_F(ATlsServer, SpeaksNoOldTls) {
  serve();
  asio::ssl::context client(asio::ssl::context::tls_client);
  client.load_verify_file(dir / "c.pem");
  ::SSL_CTX_set_security_level(client.native_handle(), 0);
  ::SSL_CTX_set_max_proto_version(client.native_handle(), TLS1_1_VERSION);
  EXPECT_THROW(get(client), boost::system::system_error);
}

TEST_F(ATlsServer, AgreesOnNoKeyThatItsCertificatesKeyWouldOpenLater) {
  serve({}, "rsa:2048");
  asio::ssl::context client(asio::ssl::context::tls_client);
  client.load_verify_file(dir / "c.pem");
  ::SSL_CTX_set_max_proto_version(client.native_handle(), TLS1_2_VERSION);
  EXPECT_EQ(get(client).rfind("HTTP/1.1 200", 0), 0u);
  ASSERT_EQ(::SSL_CTX_set_cipher_list(client.native_handle(), "kRSA"), 1);
  EXPECT_THROW(get(client), boost::system::system_error);
}

TEST_F(ATlsServer, TellsBrowsersToComeBackOverTlsAlone) {
  serve();
  asio::ssl::context client(asio::ssl::context::tls_client);
  client.load_verify_file(dir / "c.pem");
  EXPECT_NE(get(client).find("Strict-Transport-Security: max-age="), std::string::npos);
}

TEST_F(ATlsServer, TellsNothingToThoseWhoSpeakWithoutTls) {
  serve();
  TcpPeer plain(server->port(), "GET /a HTTP/1.1\r\nHost: localhost\r\n\r\n");
  EXPECT_EQ(plain.read_all().find("secret"), std::string::npos);
}

TEST_F(ATlsServer, EndsHandshakesThatDoNotComeToAnEnd) {
  serve({.request = std::chrono::milliseconds(100)});
  TcpPeer silent(server->port()),
      halfway(server->port(), std::string("\x16\x03\x01\x00\xc8\x01", 6));
  silent.read_all();
  halfway.read_all();
  asio::ssl::context client(asio::ssl::context::tls_client);
  client.load_verify_file(dir / "c.pem");
  EXPECT_EQ(get(client).rfind("HTTP/1.1 200", 0), 0u);
}

TEST_F(ATlsServer, SurvivesHandshakesOfGarbage) {
  serve();
  for (int i = 0; i < 50; ++i) {
    TcpPeer(server->port(),
            std::string("\x16\x03\x01\x02\x00", 5) + std::string(600, static_cast<char>(i)));
  }
  asio::ssl::context client(asio::ssl::context::tls_client);
  client.load_verify_file(dir / "c.pem");
  EXPECT_EQ(get(client).rfind("HTTP/1.1 200", 0), 0u);
}

TEST_F(ATlsServer, NamesTheFileThatItCannotUse) {
  make_certificate(dir / "c.pem", dir / "k.pem");
  make_certificate(dir / "other.pem", dir / "others_key.pem");
  std::ofstream(dir / "garbage.pem") << "-----BEGIN CERTIFICATE-----\ngarbage\n";
  const auto words = [&](const char* certificate, const char* key) -> std::string {
    try {
      HttpServer no(context, NetworkAddress{"127.0.0.1", 0, dir / certificate, dir / key}, {});
    } catch (const SocketError& error) {
      return error.what();
    }
    return "accepted";
  };
  EXPECT_NE(words("none.pem", "k.pem").find("none.pem: No such file"), std::string::npos);
  EXPECT_NE(words("garbage.pem", "k.pem").find("tls_certificate"), std::string::npos);
  EXPECT_NE(words("c.pem", "none.pem").find("none.pem"), std::string::npos);
  EXPECT_NE(words("c.pem", "garbage.pem").find("tls_key"), std::string::npos);
  EXPECT_NE(words("c.pem", "others_key.pem").find("tls_key"), std::string::npos);
}

}  // namespace
}  // namespace cellcal::daemon
