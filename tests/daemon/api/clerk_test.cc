#include <gtest/gtest.h>

#include <future>
#include <mutex>
#include <thread>
#include <vector>

#include "daemon/api/http/server.h"

namespace cellcal::daemon {
namespace {

struct AClerk : ::testing::Test {
  ~AClerk() override {
    if (!let_go) release();
  }
  static Request request(const std::string& method, const std::string& name) {
    Request one = parse_target(method, "/", "");
    one.caller.name = name;
    return one;
  }
  bool post(const std::string& method, const std::string& name) {
    return clerk.post(request(method, name), [this, method, name] {
      const std::lock_guard lock(mutex);
      done.push_back(method + " " + name);
    });
  }
  /// Occupies the worker, so that further requests wait.
  void occupy() {
    std::promise<void> begun;
    clerk.post(request("GET", "first"), [&] {
      begun.set_value();
      gate.wait();
    });
    begun.get_future().wait();
  }
  void release() {
    let_go = true;
    released.set_value();
  }
  /// All waiting requests, in the order of their execution.
  std::vector<std::string> all_done() {
    release();
    std::promise<void> last;
    while (!clerk.post(request("GET", "last"), [&] { last.set_value(); }))
      std::this_thread::yield();
    last.get_future().wait();
    return done;
  }

  std::promise<void> released;
  std::shared_future<void> gate = released.get_future().share();
  std::mutex mutex;
  std::vector<std::string> done;
  bool let_go = false;
  Clerk clerk;
};

TEST(AQuery, IsDecodedWhereABrowserEscapesIt) {
  const auto value = [](const std::string& written) {
    return parse_target("GET", "/v1/cell-form?file=" + written, "").query.at("file");
  };
  EXPECT_EQ(value("%2Fcells%2fa%20b.toml"), "/cells/a b.toml");
  EXPECT_EQ(value("/cells/a.toml"), "/cells/a.toml");
  for (const char* as_it_is : {"%", "%2", "%zz", "100%", "a+b"})
    EXPECT_EQ(value(as_it_is), as_it_is);
}

TEST_F(AClerk, HasRoomForOthersWhenOneTokenAsksForAllThereIs) {
  occupy();
  int taken = 0;
  for (int i = 0; i < 400; ++i) taken += post("GET", "screen");
  EXPECT_GE(taken, 1);
  EXPECT_TRUE(post("GET", "another"));
  for (int i = 0; i < 400; ++i) post("POST", "operator");
  EXPECT_TRUE(post("POST", "another operator"));
}

TEST_F(AClerk, HasRoomForWhatDoesSomethingHoweverManyLook) {
  occupy();
  for (int i = 0; i < 400; ++i) post("GET", "screen " + std::to_string(i));
  EXPECT_FALSE(post("GET", "one more"));
  EXPECT_TRUE(post("POST", "operator"));
}

TEST_F(AClerk, TakesWhatDoesSomethingBeforeWhatOnlyLooksAndEachInItsOrder) {
  occupy();
  post("GET", "a");
  post("GET", "b");
  post("POST", "c");
  post("DELETE", "d");
  EXPECT_EQ(all_done(), (std::vector<std::string>{"POST c", "DELETE d", "GET a", "GET b"}));
}

}  // namespace
}  // namespace cellcal::daemon
