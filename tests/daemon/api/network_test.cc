// A server on the loopback, and followers of its event streams.

#include <gtest/gtest.h>

#include <atomic>
#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <ctime>
#include <future>
#include <list>
#include <thread>
#include <vector>

#include "calib/model/long_work.h"
#include "daemon/api/http/server.h"
#include "tests/daemon/api/tcp_peer.h"

namespace cellcal::daemon {
namespace {

using testing::TcpPeer;

std::atomic<int> asked_for_news{0};

/// Gives "tick N" for each tick made, or endless data.
class Ticks final : public Stream {
 public:
  Ticks(const std::atomic<int>& made, bool endless) : made_(made), endless_(endless) {}
  std::optional<std::string> next() override {
    ++asked_for_news;
    if (endless_) return std::string(100'000, 'x');
    std::string text;
    while (given_ < made_) text += "tick " + std::to_string(++given_) + "\n";
    return text;
  }

 private:
  const std::atomic<int>& made_;
  bool endless_;
  int given_ = 0;
};

/// More than the buffers of a socket.
constexpr std::size_t kLarge = std::size_t{8} << 20;

class ServedOnPort {
 public:
  explicit ServedOnPort(ServerLimits limits = {})
      : server(context, NetworkAddress{"127.0.0.1", 0},
               {[](Request& request) -> std::optional<Response> {
                  if (request.path == "/no") return error(401, "no");
                  request.caller.name = request.header("x-name");
                  return std::nullopt;
                },
                [this](const Request& request, bool) -> std::optional<Response> {
                  ++asked;
                  Response response{
                      200, "text/plain",
                      request.method + " " + request.path + " " + request.header("x-word")};
                  if (request.path == "/ticks" || request.path == "/endless") {
                    response.stream = std::make_shared<Ticks>(made, request.path == "/endless");
                  }
                  if (request.path == "/gate") gate.wait();
                  while (request.path == "/long/slow") calib::poll_cancelled();
                  if (request.path.starts_with("/large")) response.body.assign(kLarge, 'x');
                  return response;
                },
                [](const Request& request) {
                  return request.path.ends_with("/slow") || request.path.starts_with("/gate");
                },
                limits}),
        thread([this] { context.run(); }) {}
  ~ServedOnPort() {
    boost::asio::post(context, [this] {
      server.stop();
      work.reset();
    });
    thread.join();
  }
  std::uint16_t port() const { return server.port(); }
  void tick() {
    ++made;
    server.poke();
  }

  boost::asio::io_context context;
  boost::asio::executor_work_guard<boost::asio::io_context::executor_type> work{
      context.get_executor()};
  std::atomic<int> made{0}, asked{0};
  std::promise<void> opened;
  std::shared_future<void> gate = opened.get_future().share();
  HttpServer server;
  std::thread thread;
};

constexpr const char* kFollow = "GET /ticks HTTP/1.1\r\nHost: x\r\n\r\n";

std::string ask(const ServedOnPort& served, const std::string& path) {
  TcpPeer peer(served.port(),
               "GET " + path + " HTTP/1.1\r\nHost: x\r\nX-Word: word\r\nConnection: close\r\n\r\n");
  return peer.read_all();
}

TEST(ANetworkServer, AnswersAndHandsOnTheHeaders) {
  const ServedOnPort served;
  const std::string answer = ask(served, "/a");
  EXPECT_EQ(answer.rfind("HTTP/1.1 200", 0), 0u) << answer;
  EXPECT_NE(answer.find("GET /a word"), std::string::npos) << answer;
}

TEST(ANetworkServer, StatesItsTimeWithEachAnswer) {
  const ServedOnPort served;
  const std::time_t before = std::time(nullptr);
  const std::string answer = ask(served, "/a");
  const std::size_t at = answer.find("\r\nDate: ");
  ASSERT_NE(at, std::string::npos) << answer;
  std::tm stated{};
  const char* end = ::strptime(answer.c_str() + at + 8, "%a, %d %b %Y %H:%M:%S GMT\r\n", &stated);
  ASSERT_NE(end, nullptr) << answer;
  EXPECT_GE(::timegm(&stated), before);
  EXPECT_LE(::timegm(&stated), std::time(nullptr));
}

TEST(ANetworkServer, AsksNobodyForTheAnswerToOneWhoIsNotAdmitted) {
  const ServedOnPort served;
  EXPECT_EQ(ask(served, "/no").rfind("HTTP/1.1 401", 0), 0u);
  EXPECT_EQ(served.asked, 0);
}

TEST(ANetworkServer, RefusesWhatIsNotHttpSoThatItsSenderCanReadWhy) {
  const ServedOnPort served;
  TcpPeer garbage(served.port(), std::string(200'000, '\xff'));
  EXPECT_EQ(garbage.read_all().rfind("HTTP/1.1 4", 0), 0u);
  TcpPeer endless(served.port(), "GET / HTTP/1.1\r\nX: " + std::string(100'000, 'a'));
  EXPECT_EQ(endless.read_all().rfind("HTTP/1.1 431", 0), 0u);
  EXPECT_EQ(ask(served, "/a").rfind("HTTP/1.1 200", 0), 0u);
}

TEST(ANetworkServer, EndsAConnectionWhoseRequestDoesNotCome) {
  const ServedOnPort served({.request = std::chrono::milliseconds(50)});
  TcpPeer silent(served.port()), halfway(served.port(), "GET / HTTP/1.1\r\nHo");
  EXPECT_EQ(silent.read_all(), "");
  EXPECT_EQ(halfway.read_all(), "");
}

TEST(ANetworkServer, TellsFollowersEachPieceOnceAndAsItComes) {
  ServedOnPort served;
  TcpPeer peer(served.port(), kFollow);
  const std::string head = peer.read_until("\r\n\r\n");
  EXPECT_EQ(head.rfind("HTTP/1.1 200", 0), 0u) << head;
  EXPECT_EQ(head.find("Content-Length"), std::string::npos) << head;
  for (int i = 1; i <= 20; ++i) {
    served.tick();
    peer.read_until("tick " + std::to_string(i) + "\n");
  }
  const std::string all = peer.read_until("tick 20\n");
  for (int i = 1; i <= 20; ++i) {
    const std::string one = "tick " + std::to_string(i) + "\n";
    EXPECT_EQ(all.find(one), all.rfind(one)) << i;
  }
}

TEST(ANetworkServer, DoesNotAskForNewsAsOftenAsItIsPoked) {
  ServedOnPort served;
  TcpPeer peer(served.port(), kFollow);
  peer.read_until("\r\n\r\n");
  asked_for_news = 0;
  const auto begin = std::chrono::steady_clock::now();
  for (int i = 0; i < 300; ++i) {
    served.tick();
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  peer.read_until("tick 300\n");
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
  // Twenty times a second, and once after each piece taken.
  EXPECT_LE(asked_for_news, 2 * (took.count() / 0.05 + 3));
  EXPECT_LT(asked_for_news, 300);
}

TEST(ANetworkServer, KeepsFiftyFollowersWhateverElseConnects) {
  ServedOnPort served;
  std::vector<TcpPeer> followers;
  for (int i = 0; i < 50; ++i) {
    followers.emplace_back(served.port(), kFollow);
    followers.back().read_until("\r\n\r\n");
  }
  std::vector<TcpPeer> idle;
  for (int i = 0; i < 300; ++i) {
    idle.emplace_back(served.port(), i % 2 == 0 ? "" : "POST /v1/abort HTTP/1.1\r\nX: ");
    ASSERT_TRUE(idle.back().connected());
  }
  EXPECT_EQ(ask(served, "/a").rfind("HTTP/1.1 200", 0), 0u);
  served.tick();
  for (TcpPeer& one : followers) {
    EXPECT_NE(one.read_until("tick 1\n").find("tick 1\n"), std::string::npos);
  }
}

TEST(ANetworkServer, RefusesFollowersBeyondItsNumberAndAnswersRequestsAllTheSame) {
  ServedOnPort served;
  std::list<TcpPeer> followers;
  for (int i = 0; i < 80; ++i) {
    followers.emplace_back(served.port(), kFollow);
    const std::string head = followers.back().read_until("\r\n\r\n");
    EXPECT_EQ(head.rfind(i < 56 ? "HTTP/1.1 200" : "HTTP/1.1 503", 0), 0u) << i << head;
  }
  EXPECT_EQ(ask(served, "/a").rfind("HTTP/1.1 200", 0), 0u);
  // A closed follower makes room.
  followers.pop_front();
  std::string head;
  while (head.rfind("HTTP/1.1 200", 0) != 0) {
    head = TcpPeer(served.port(), kFollow).read_until("\r\n\r\n");
  }
}

TEST(ANetworkServer, LetsNoCallerKeepTheOthersFromFollowing) {
  ServedOnPort served;
  const auto follow = [&](const char* name) {
    TcpPeer peer(served.port(),
                 std::string("GET /ticks HTTP/1.1\r\nHost: a\r\nX-Name: ") + name + "\r\n\r\n");
    const bool follows = peer.read_until("\r\n\r\n").starts_with("HTTP/1.1 200");
    return std::pair(std::move(peer), follows);
  };
  std::list<std::pair<TcpPeer, bool>> greedy, others;
  for (int i = 0; i < 56; ++i) greedy.push_back(follow("greedy"));
  EXPECT_FALSE(follow("greedy").second);
  for (int i = 0; i < 28; ++i) {
    others.push_back(follow("other"));
    EXPECT_TRUE(others.back().second) << i;
  }
  EXPECT_FALSE(follow("other").second) << "half each";
  served.tick();
  EXPECT_NE(greedy.front().first.read_until("tick 1\n").find("tick 1\n"), std::string::npos);
}

TEST(ANetworkServer, RefusesAHeaderThatDecidesAndIsThereTwice) {
  ServedOnPort served;
  for (const char* twice : {"Host: a\r\nHost: b", "Host: a\r\nOrigin: http://a\r\nORIGIN: http://b",
                            "Host: a\r\nAuthorization: Bearer x\r\nauthorization: Bearer y"}) {
    TcpPeer peer(served.port(), std::string("GET /a HTTP/1.1\r\n") + twice + "\r\n\r\n");
    EXPECT_TRUE(peer.read_all().starts_with("HTTP/1.1 400")) << twice;
  }
  EXPECT_EQ(served.asked, 0);
}

TEST(ANetworkServer, CallsOffWhatOnlyLooksWhereItStops) {
  auto served = std::make_unique<ServedOnPort>();
  TcpPeer peer(served->port(), "GET /long/slow HTTP/1.1\r\nHost: a\r\n\r\n");
  while (served->asked == 0) std::this_thread::yield();
  served.reset();  // the request would not end by itself
  EXPECT_FALSE(peer.read_all().starts_with("HTTP/1.1 200"));
}

TEST(ANetworkServer, CutsAFollowerThatDoesNotRead) {
  ServedOnPort served({.follower = std::chrono::milliseconds(200)});
  TcpPeer slow(served.port(), "GET /endless HTTP/1.1\r\nHost: x\r\n\r\n", 4096);
  TcpPeer quick(served.port(), kFollow);
  quick.read_until("\r\n\r\n");
  // The cut is noticed on reading: first data in transit, then the end.
  std::this_thread::sleep_for(std::chrono::milliseconds(600));
  slow.read_all();
  served.tick();
  EXPECT_NE(quick.read_until("tick 1\n").find("tick 1"), std::string::npos);
}

TEST(ANetworkServer, EndsAFollowerThatSendsMore) {
  ServedOnPort served;
  TcpPeer peer(served.port(), kFollow);
  peer.read_until("\r\n\r\n");
  peer.send("garbage");
  peer.read_all();  // returns since it was closed
}

TEST(ANetworkServer, HoldsNoMoreOfLargeAnswersThanItHasRoomFor) {
  for (const std::string path : {"/large", "/large/slow"}) {
    const ServedOnPort served({.answer_bytes = 2 * kLarge});
    const std::string request = "GET " + path + " HTTP/1.1\r\nHost: x\r\n\r\n";
    std::list<TcpPeer> slow;
    for (int i = 0; i < 60; ++i) {
      slow.emplace_back(served.port(), request, 4096);
      const std::string head = slow.back().read_until("\r\n\r\n");
      EXPECT_EQ(head.rfind(i < 2 ? "HTTP/1.1 200" : "HTTP/1.1 503", 0), 0u)
          << i << head.substr(0, 80);
      EXPECT_EQ(head.find("\r\nRetry-After: ") != std::string::npos, i >= 2) << i;
    }
    EXPECT_EQ(ask(served, "/a").rfind("HTTP/1.1 200", 0), 0u);
    slow.clear();  // makes room
    std::string all;
    while (all.rfind("HTTP/1.1 200", 0) != 0) all = ask(served, path);
    EXPECT_GT(all.size(), kLarge);
  }
}

TEST(ANetworkServer, GivesAnAnswerThatIsLargerThanAllItHasRoomForAlone) {
  const ServedOnPort served({.answer_bytes = kLarge / 2});
  TcpPeer slow(served.port(), "GET /large HTTP/1.1\r\nHost: x\r\n\r\n", 4096);
  EXPECT_EQ(slow.read_until("\r\n\r\n").rfind("HTTP/1.1 200", 0), 0u);
  EXPECT_EQ(ask(served, "/large").rfind("HTTP/1.1 503", 0), 0u);
}

TEST(ANetworkServer, CountsNoAnswerThatWasTakenWhateverItsReaderDoesThen) {
  const ServedOnPort served({.answer_bytes = kLarge});
  std::list<TcpPeer> stay;
  for (int i = 0; i < 3; ++i) {
    stay.emplace_back(served.port(), "GET /large HTTP/1.1\r\nHost: x\r\n\r\n");
    const std::string whole = stay.back().read_bytes(kLarge);
    EXPECT_EQ(whole.rfind("HTTP/1.1 200", 0), 0u) << i << whole.substr(0, 80);
    // Its memory is released once the daemon knows that it was sent.
    stay.back().send("GET /a HTTP/1.1\r\nHost: x\r\n\r\n");
    stay.back().read_until("GET /a ");
  }
}

TEST(ANetworkServer, DoesNothingThatHasWaitedForTooLongBehindOthers) {
  ServedOnPort served({.queue = std::chrono::milliseconds(20)});
  TcpPeer first(served.port(), "GET /gate HTTP/1.1\r\nHost: x\r\n\r\n");
  while (served.asked == 0) std::this_thread::yield();
  TcpPeer act(served.port(), "POST /gate/run HTTP/1.1\r\nHost: x\r\nContent-Length: 0\r\n\r\n");
  TcpPeer look(served.port(), "GET /gate/look HTTP/1.1\r\nHost: x\r\n\r\n");
  // Both have arrived when a later request is answered.
  EXPECT_EQ(ask(served, "/a").rfind("HTTP/1.1 200", 0), 0u);
  std::this_thread::sleep_for(std::chrono::milliseconds(100));
  served.opened.set_value();
  const std::string refused = act.read_until("nothing was done");
  EXPECT_EQ(refused.rfind("HTTP/1.1 503", 0), 0u) << refused;
  EXPECT_NE(refused.find("Retry-After"), std::string::npos) << refused;
  EXPECT_EQ(look.read_until("look").rfind("HTTP/1.1 200", 0), 0u) << "it changes nothing";
  EXPECT_EQ(served.asked, 3) << "the gate, /a and the look";
}

TEST(ANetworkServer, SaysWhereItCannotListen) {
  const ServedOnPort served;
  boost::asio::io_context context;
  for (const NetworkAddress& address :
       {NetworkAddress{"127.0.0.1", served.port()}, NetworkAddress{"192.0.2.1", 8080}}) {
    try {
      HttpServer second(context, address, {});
      FAIL() << address.address;
    } catch (const SocketError& wrong) {
      const std::string words = wrong.what();
      EXPECT_NE(words.find(address.address), std::string::npos) << words;
      EXPECT_NE(words.find("[http]"), std::string::npos) << words;
    }
  }
}

}  // namespace
}  // namespace cellcal::daemon
