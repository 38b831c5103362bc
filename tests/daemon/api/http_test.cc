// A real server on a real socket, and hostile clients.

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <atomic>
#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <cstring>
#include <fstream>
#include <future>
#include <thread>
#include <utility>
#include <vector>

#include "daemon/api/http/server.h"
#include "tests/daemon/journal/temporary_directory.h"

namespace cellcal::daemon {
namespace {

using testing::TemporaryDirectory;

/// Admits all requests and gives empty answers.
const ServerParts kAnything{[](Request&) { return std::nullopt; },
                            [](const Request&, bool) { return Response{}; }};

/// Echoes the path; "/later" has no answer before `ready`, "/slow" blocks until `released`.
class ServedOnSocket {
 public:
  explicit ServedOnSocket(const std::filesystem::path& path) : socket(path) {
    server = std::make_unique<HttpServer>(
        context, socket,
        ServerParts{[](Request&) { return std::nullopt; },
                    [this](const Request& request, bool give_up) -> std::optional<Response> {
                      ++asked;
                      if (request.path == "/slow") gate.wait();
                      if (request.path == "/later" && !ready && !give_up) return std::nullopt;
                      return Response{200, "text/plain",
                                      request.method + " " + request.path + " " +
                                          std::to_string(request.body.size())};
                    },
                    [](const Request& request) { return request.path == "/slow"; }});
    thread = std::thread([this] { context.run(); });
  }
  ~ServedOnSocket() {
    boost::asio::post(context, [this] {
      server->stop();
      work.reset();
    });
    thread.join();
  }

  boost::asio::io_context context;
  boost::asio::executor_work_guard<boost::asio::io_context::executor_type> work{
      context.get_executor()};
  std::filesystem::path socket;
  std::atomic<int> asked{0};
  std::atomic<bool> ready{false};
  std::promise<void> released;
  std::shared_future<void> gate = released.get_future().share();
  std::unique_ptr<HttpServer> server;
  std::thread thread;
};

/// Sends bytes unmodified; returns the reply until the peer closes or sends no more.
std::string raw(const std::filesystem::path& socket, const std::string& bytes, bool half_close) {
  const int fd = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::strncpy(address.sun_path, socket.c_str(), sizeof address.sun_path - 1);
  if (::connect(fd, reinterpret_cast<sockaddr*>(&address), sizeof address) != 0) {
    ::close(fd);
    return "no connection";
  }
  std::size_t sent = 0;
  while (sent < bytes.size()) {
    const ssize_t now = ::send(fd, bytes.data() + sent, bytes.size() - sent, MSG_NOSIGNAL);
    if (now <= 0) break;  // refused half-way: the answer states why
    sent += static_cast<std::size_t>(now);
  }
  if (half_close) ::shutdown(fd, SHUT_WR);
  std::string answer;
  char buffer[4096];
  for (ssize_t got = 0; (got = ::recv(fd, buffer, sizeof buffer, 0)) > 0;) {
    answer.append(buffer, static_cast<std::size_t>(got));
  }
  ::close(fd);
  return answer;
}

TEST(AServer, AnswersAClient) {
  const TemporaryDirectory dir;
  const ServedOnSocket served(dir / "s");
  const Response response = http_request(dir / "s", "POST", "/v1/x?y=1", "12345");
  EXPECT_EQ(response.status, 200);
  EXPECT_EQ(response.body, "POST /v1/x 5");
  EXPECT_EQ(response.type, "text/plain");
}

TEST(AServer, LetsOwnerAndGroupInAndNobodyElse) {
  const TemporaryDirectory dir;
  const ServedOnSocket served(dir / "s");
  struct stat info {};
  ASSERT_EQ(::stat((dir / "s").c_str(), &info), 0);
  EXPECT_EQ(info.st_mode & 0777, 0660u);
}

TEST(AServer, ReplacesTheSocketOfADeadOneAndRemovesItsOwn) {
  const TemporaryDirectory dir;
  const int fd = ::socket(AF_UNIX, SOCK_STREAM, 0);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::strncpy(address.sun_path, (dir / "s").c_str(), sizeof address.sun_path - 1);
  ASSERT_EQ(::bind(fd, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
  ::close(fd);
  {
    const ServedOnSocket served(dir / "s");
    EXPECT_EQ(http_request(dir / "s", "GET", "/").status, 200);
  }
  EXPECT_FALSE(std::filesystem::exists(dir / "s"));
}

TEST(AServer, RefusesToPushALivingOneAside) {
  const TemporaryDirectory dir;
  const ServedOnSocket served(dir / "s");
  boost::asio::io_context context;
  try {
    HttpServer second(context, dir / "s", kAnything);
    FAIL();
  } catch (const SocketError& error) {
    EXPECT_NE(std::string(error.what()).find("another cellcald"), std::string::npos);
  }
  EXPECT_EQ(http_request(dir / "s", "GET", "/").status, 200);
}

TEST(AServer, DoesNotRemoveAFileThatIsNoSocket) {
  const TemporaryDirectory dir;
  std::ofstream(dir / "s") << "mine";
  boost::asio::io_context context;
  EXPECT_THROW(HttpServer(context, dir / "s", kAnything), SocketError);
  EXPECT_TRUE(std::filesystem::exists(dir / "s"));
}

TEST(AServer, SaysWhereItCannotListen) {
  boost::asio::io_context context;
  for (const std::string& path : {std::string("/nonexistent/s"), std::string(200, 'x')}) {
    try {
      HttpServer server(context, path, kAnything);
      FAIL() << path;
    } catch (const SocketError& error) {
      EXPECT_NE(std::string(error.what()).find(path), std::string::npos) << error.what();
    }
  }
}

TEST(AServer, RefusesWhatIsNotHttpAndLivesOn) {
  const TemporaryDirectory dir;
  const ServedOnSocket served(dir / "s");
  for (const std::string& bytes :
       {std::string("\x00\xff\xfe garbage\r\n\r\n", 16), std::string("GET\r\n\r\n"),
        std::string("GET / HTTP/9.9\r\n\r\n"), std::string("\r\n\r\n\r\n\r\nX\r\n\r\n"),
        std::string("POST / HTTP/1.1\r\nContent-Length: -1\r\n\r\n"),
        std::string("POST / HTTP/1.1\r\nContent-Length: 99999999999999999999\r\n\r\n"),
        std::string("GET / HTTP/1.1\r\nBad Header\r\n\r\n")}) {
    EXPECT_EQ(raw(dir / "s", bytes, true).rfind("HTTP/1.1 400", 0), 0u) << bytes;
  }
  EXPECT_EQ(served.asked, 0);
  EXPECT_EQ(http_request(dir / "s", "GET", "/").status, 200);
}

TEST(AServer, RefusesABodyThatIsTooLongBeforeItIsSent) {
  const TemporaryDirectory dir;
  const ServedOnSocket served(dir / "s");
  const std::string head = "POST /v1/run HTTP/1.1\r\nContent-Length: 70000\r\n\r\n";
  EXPECT_EQ(raw(dir / "s", head, false).rfind("HTTP/1.1 413", 0), 0u);
  EXPECT_EQ(http_request(dir / "s", "POST", "/", std::string(60000, 'x')).status, 200);
}

TEST(AServer, TakesAFileFromWhomItAdmitsAndOfNobodyElse) {
  const TemporaryDirectory dir;
  boost::asio::io_context context;
  std::size_t got = 0;
  HttpServer server(context, dir / "s",
                    ServerParts{[](Request& request) -> std::optional<Response> {
                                  if (request.header("authorization") == "Bearer t") return {};
                                  return error(401, "a token is needed");
                                },
                                [&](const Request& request, bool) {
                                  got = request.body.size();
                                  return Response{};
                                },
                                {},
                                {},
                                [](const Request& request) {
                                  return request.path == "/file" ? std::size_t{1} << 20 : 0;
                                }});
  std::thread thread([&] { context.run(); });
  const auto sent = [&](const std::string& path, const std::string& token, std::size_t length,
                        std::size_t bytes) {
    return raw(dir / "s",
               "POST " + path + " HTTP/1.1\r\nConnection: close\r\nAuthorization: Bearer " + token +
                   "\r\nContent-Length: " + std::to_string(length) + "\r\n\r\n" +
                   std::string(bytes, 'x'),
               false)
        .substr(0, 12);
  };
  EXPECT_EQ(sent("/file", "t", 300000, 300000), "HTTP/1.1 200");
  EXPECT_EQ(got, 300000u);
  EXPECT_EQ(sent("/other", "t", 300000, 0), "HTTP/1.1 413");
  EXPECT_EQ(sent("/file", "t", (1u << 20) + 1, 0), "HTTP/1.1 413");
  EXPECT_EQ(sent("/file", "none", 300000, 0), "HTTP/1.1 401") << "before it sends the file";
  const std::string chunks =
      "POST /file HTTP/1.1\r\nAuthorization: Bearer t\r\nTransfer-Encoding: "
      "chunked\r\n\r\n20000\r\n" +
      std::string(0x20000, 'x') + "\r\n0\r\n\r\n";
  EXPECT_EQ(raw(dir / "s", chunks, false).substr(0, 12), "HTTP/1.1 413") << "of unknown length";
  boost::asio::post(context, [&] { server.stop(); });
  thread.join();
}

TEST(AServer, RefusesAHeaderWithoutEnd) {
  const TemporaryDirectory dir;
  const ServedOnSocket served(dir / "s");
  const std::string endless = "GET / HTTP/1.1\r\nX: " + std::string(100000, 'a');
  EXPECT_EQ(raw(dir / "s", endless, false).rfind("HTTP/1.1 431", 0), 0u);
}

TEST(AServer, SurvivesClientsThatLeaveInTheMiddle) {
  const TemporaryDirectory dir;
  const ServedOnSocket served(dir / "s");
  const std::string whole = "POST /v1/run HTTP/1.1\r\nContent-Length: 10\r\n\r\n0123456789";
  for (std::size_t length = 0; length < whole.size(); ++length) {
    raw(dir / "s", whole.substr(0, length), true);
  }
  EXPECT_EQ(served.asked, 0);
  EXPECT_EQ(http_request(dir / "s", "GET", "/").status, 200);
}

TEST(AServer, GivesAnAnswerThatHadToWait) {
  const TemporaryDirectory dir;
  ServedOnSocket served(dir / "s");
  std::thread client(
      [&] { EXPECT_EQ(http_request(dir / "s", "GET", "/later").body, "GET /later 0"); });
  while (served.asked == 0) std::this_thread::yield();
  // A quick request is answered meanwhile.
  EXPECT_EQ(http_request(dir / "s", "GET", "/now").status, 200);
  served.ready = true;
  served.server->poke();
  client.join();
}

/// Connected without sending anything.
class Idle {
 public:
  explicit Idle(const std::filesystem::path& socket, const std::string& bytes = "")
      : fd_(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::strncpy(address.sun_path, socket.c_str(), sizeof address.sun_path - 1);
    connected_ = ::connect(fd_, reinterpret_cast<sockaddr*>(&address), sizeof address) == 0;
    if (!bytes.empty()) connected_ &= ::send(fd_, bytes.data(), bytes.size(), MSG_NOSIGNAL) > 0;
  }
  ~Idle() { ::close(fd_); }
  Idle(Idle&& other) noexcept : fd_(std::exchange(other.fd_, -1)), connected_(other.connected_) {}
  bool connected() const { return connected_; }

 private:
  int fd_;
  bool connected_ = false;
};

TEST(AServer, HasRoomForOneMoreWhoeverHoldsItsConnections) {
  const TemporaryDirectory dir;
  const ServedOnSocket served(dir / "s");
  // Silent clients, incomplete requests, and clients waiting for a change.
  for (const std::string& bytes : {std::string(), std::string("POST /v1/abort HTTP/1.1\r\nX: "),
                                   std::string("GET /later HTTP/1.1\r\n\r\n")}) {
    std::vector<Idle> idle;
    for (int i = 0; i < 400; ++i) {
      idle.emplace_back(dir / "s", bytes);
      ASSERT_TRUE(idle.back().connected()) << i;
    }
    EXPECT_EQ(http_request(dir / "s", "POST", "/v1/abort").body, "POST /v1/abort 0") << bytes;
  }
}

TEST(AServer, EndsSilentConnectionsBeforeThoseThatWaitForAnAnswer) {
  const TemporaryDirectory dir;
  ServedOnSocket served(dir / "s");
  std::thread client(
      [&] { EXPECT_EQ(http_request(dir / "s", "GET", "/later").body, "GET /later 0"); });
  while (served.asked == 0) std::this_thread::yield();
  std::vector<Idle> idle;
  for (int i = 0; i < 200; ++i) idle.emplace_back(dir / "s");
  EXPECT_EQ(http_request(dir / "s", "GET", "/now").status, 200);
  served.ready = true;
  served.server->poke();
  client.join();
}

TEST(AServer, AnswersOthersWhileASlowRequestWaits) {
  const TemporaryDirectory dir;
  ServedOnSocket served(dir / "s");
  std::atomic<bool> answered{false};
  std::thread client([&] {
    EXPECT_EQ(http_request(dir / "s", "GET", "/slow").body, "GET /slow 0");
    answered = true;
  });
  while (served.asked == 0) std::this_thread::yield();
  EXPECT_EQ(http_request(dir / "s", "POST", "/v1/abort").status, 200);
  EXPECT_FALSE(answered);
  served.released.set_value();
  client.join();
}

TEST(AServer, WhoseSlowRequestsPileUpSaysSoAndAnswersTheOthers) {
  const TemporaryDirectory dir;
  ServedOnSocket served(dir / "s");
  std::vector<Idle> waiting;
  for (int i = 0; i < 400; ++i) {
    waiting.emplace_back(dir / "s", "GET /slow HTTP/1.1\r\n\r\n");
  }
  while (served.asked == 0) std::this_thread::yield();
  EXPECT_EQ(http_request(dir / "s", "GET", "/slow").status, 503);
  EXPECT_EQ(http_request(dir / "s", "POST", "/v1/abort").status, 200);
  served.released.set_value();
}

TEST(AServer, ServesManyClientsOneAfterTheOther) {
  const TemporaryDirectory dir;
  const ServedOnSocket served(dir / "s");
  for (int i = 0; i < 200; ++i) {
    ASSERT_EQ(http_request(dir / "s", "GET", "/").status, 200) << i;
  }
}

TEST(AClient, SaysThatThereIsNoDaemonAndWhatToDo) {
  const TemporaryDirectory dir;
  try {
    http_request(dir / "none.sock", "GET", "/");
    FAIL();
  } catch (const SocketError& error) {
    const std::string words = error.what();
    EXPECT_NE(words.find("none.sock"), std::string::npos) << words;
    EXPECT_NE(words.find("Start it"), std::string::npos) << words;
  }
}

}  // namespace
}  // namespace cellcal::daemon
