// Content of the event stream for a follower, without a socket.

#include "daemon/api/event_feed.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <random>
#include <set>

namespace cellcal::daemon {
namespace {

using nlohmann::json;

struct Event {
  std::string name, id;
  json data;
};

/// As parsed by a browser; comments are skipped.
std::vector<Event> events_in(const std::string& text) {
  std::vector<Event> events;
  Event now;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = text.find('\n', at);
    EXPECT_NE(end, std::string::npos) << "a line is not whole";
    const std::string line = text.substr(at, end - at);
    at = end + 1;
    if (line.empty()) {
      if (!now.name.empty()) events.push_back(now);
      now = {};
    } else if (line.rfind("event: ", 0) == 0) {
      now.name = line.substr(7);
    } else if (line.rfind("id: ", 0) == 0) {
      now.id = line.substr(4);
    } else if (line.rfind("data: ", 0) == 0) {
      now.data = json::parse(line.substr(6));
    } else {
      EXPECT_EQ(line, ":");
    }
  }
  EXPECT_TRUE(now.name.empty()) << "an event is not whole";
  return events;
}

/// Simulated status of a service, with the same history length.
struct AFeed : ::testing::Test {
  AFeed() { history.emplace_back(); }

  void happen(bool touch = false) {
    Status next;
    next.seq = history.back().seq + 1;
    next.session = 3;
    next.phase = next.seq % 2 == 0 ? Phase::kTransit : Phase::kRetreat;
    if (touch) {
      auto made = std::make_shared<MadeTouch>();
      made->session = 3;
      made->index = touches++;
      made->touch.target = "S1";
      made->touch.joint_rad = {0.5};
      made->tip_m = {0.001, 0.002, 0.003};
      next.made = made;
    }
    next.done = touches;
    history.push_back(next);
    if (history.size() > 512) history.erase(history.begin());
  }
  void move(double joint_rad, drivers::RobotLink link = drivers::RobotLink::kReady) {
    auto report = std::make_shared<LinkReport>();
    report->open = true;
    report->robot.link = link;
    report->robot.actual_rad = {joint_rad};
    links = report;
  }
  std::vector<Event> take(Stream& stream) {
    std::vector<Event> all;
    while (true) {
      const auto piece = stream.next();
      EXPECT_TRUE(piece) << "cut";
      if (!piece || piece->empty() || *piece == ":\n\n") return all;
      for (Event& event : events_in(*piece)) all.push_back(std::move(event));
    }
  }

  std::vector<Status> history;
  std::shared_ptr<const LinkReport> links;
  std::size_t touches = 0;
  std::chrono::steady_clock::time_point now{};
  EventFeed feed{{[this] {
                    Status status = history.back();
                    status.links = links;
                    return status;
                  },
                  [this](std::uint64_t seq) {
                    std::vector<Status> newer;
                    for (const Status& one : history) {
                      if (one.seq > seq) newer.push_back(one);
                    }
                    return newer;
                  }},
                 [this] { return now; }};
};

TEST_F(AFeed, BeginsWithTheCurrentStatusAndGoesOnWithEachChange) {
  for (int i = 0; i < 5; ++i) happen();
  const auto stream = feed.follow({});
  std::vector<Event> events = take(*stream);
  ASSERT_EQ(events.size(), 1u);
  EXPECT_EQ(events[0].name, "status");
  EXPECT_EQ(events[0].id, "5");
  EXPECT_EQ(events[0].data["session"], 3);
  happen();
  happen();
  events = take(*stream);
  ASSERT_EQ(events.size(), 2u);
  EXPECT_EQ(events[0].id, "6");
  EXPECT_EQ(events[1].id, "7");
  EXPECT_TRUE(take(*stream).empty());
}

TEST_F(AFeed, OfAnIdleDaemonSaysThatItIsIdle) {
  const auto stream = feed.follow({});
  const std::vector<Event> events = take(*stream);
  ASSERT_EQ(events.size(), 1u);
  EXPECT_EQ(events[0].id, "0");
  EXPECT_EQ(events[0].data["phase"], "idle");
}

TEST_F(AFeed, TellsOfATouchBehindTheStatusThatCountsIt) {
  const auto stream = feed.follow({});
  take(*stream);
  happen(true);
  const std::vector<Event> events = take(*stream);
  ASSERT_EQ(events.size(), 2u);
  EXPECT_EQ(events[0].name, "status");
  EXPECT_EQ(events[0].data["touches"], 1);
  EXPECT_EQ(events[1].name, "touch");
  EXPECT_EQ(events[1].id, "1.1");
  EXPECT_EQ(events[1].data["index"], 0);
  EXPECT_EQ(events[1].data["target"], "S1");
  EXPECT_EQ(events[1].data["set"], "fit");
  EXPECT_DOUBLE_EQ(events[1].data["tip_mm"][2], 3.0);
  EXPECT_TRUE(events[1].data["residual_mm"].is_null());
}

TEST_F(AFeed, WhoseConnectionBreaksAnywhereGoesOnWithoutALossOrADouble) {
  std::mt19937 random(7);
  std::optional<EventId> since;
  auto stream = feed.follow(since);
  std::vector<std::string> ids;
  for (int i = 0; i < 2000; ++i) {
    happen(random() % 7 == 0);
    if (random() % 3 != 0) continue;
    std::vector<Event> events = take(*stream);
    // Cut after any event: the client has received those before.
    const bool cut = random() % 2 == 0;
    if (cut) events.resize(events.empty() ? 0 : random() % (events.size() + 1));
    for (const Event& event : events) {
      ids.push_back(event.id);
      since = parse_event_id(event.id);
    }
    if (cut && since) stream = feed.follow(since);
  }
  for (const Event& event : take(*stream)) ids.push_back(event.id);
  std::vector<std::string> expected;
  for (std::uint64_t seq = 1; seq <= 2000; ++seq) expected.push_back(std::to_string(seq));
  std::vector<std::string> statuses, seen_touches;
  for (const std::string& id : ids) {
    (id.find('.') == std::string::npos ? statuses : seen_touches).push_back(id);
  }
  // The first may be later: the current status at the time of the connection.
  ASSERT_FALSE(statuses.empty());
  const auto first = std::stoull(statuses.front());
  EXPECT_LT(first, 20u);
  expected.erase(expected.begin(), expected.begin() + static_cast<std::ptrdiff_t>(first) - 1);
  EXPECT_EQ(statuses, expected);
  std::set<std::string> once(seen_touches.begin(), seen_touches.end());
  EXPECT_EQ(once.size(), seen_touches.size());
  EXPECT_GE(seen_touches.size() + 5, touches);
}

TEST_F(AFeed, GivesAllThatIsNewerThanTheNumberThatAClientHas) {
  for (int i = 0; i < 300; ++i) happen(i % 20 == 0);
  EXPECT_EQ(take(*feed.follow(EventId{0, false})).size(), 315u);
  EXPECT_EQ(take(*feed.follow(EventId{299, false})).size(), 1u);
  EXPECT_TRUE(take(*feed.follow(EventId{300, false})).empty());
}

TEST_F(AFeed, GivesTheCurrentStatusFirstWhereTheNumberIsTooOldOrAnotherDaemons) {
  for (int i = 0; i < 3000; ++i) happen();
  for (const std::uint64_t since : {std::uint64_t{1}, std::uint64_t{900'000}}) {
    const std::vector<Event> events = take(*feed.follow(EventId{since, false}));
    ASSERT_EQ(events.size(), 1u);
    EXPECT_EQ(events[0].id, "3000");
  }
}

TEST_F(AFeed, EndsForAFollowerThatFallsBehind) {
  const auto slow = feed.follow({}), quick = feed.follow({});
  take(*slow);
  take(*quick);
  for (int i = 0; i < 3000; ++i) {
    happen();
    if (i % 100 == 0) take(*quick);
  }
  EXPECT_FALSE(slow->next());
  EXPECT_EQ(take(*quick).back().id, "3000");
}

TEST_F(AFeed, GivesOfChangesOfWordsAloneThatCameTogetherTheNewest) {
  const auto stream = feed.follow({});
  take(*stream);
  const auto change = [this](Phase phase, const std::string& words) {
    happen();
    history.back().phase = phase;
    history.back().robot_words = words;
  };
  for (int i = 0; i < 100; ++i)
    change(Phase::kTransit, "no packet for " + std::to_string(i) + " ms");
  change(Phase::kStopping, "no packet for 100 ms");
  change(Phase::kFailed, "down");
  const std::vector<Event> events = take(*stream);
  ASSERT_EQ(events.size(), 3u);
  EXPECT_EQ(events[0].data["robot"], "no packet for 99 ms");
  EXPECT_EQ(events[1].data["phase"], "stopping");
  EXPECT_EQ(events[2].data["phase"], "failed");
  // A stream can also be continued from an omitted event.
  EXPECT_EQ(take(*feed.follow(EventId{50, false})).size(), 3u);
  EXPECT_EQ(take(*feed.follow(EventId{101, false})).size(), 1u);
}

TEST_F(AFeed, NeverGivesMoreThanABoundedPieceAtOnce) {
  const auto stream = feed.follow(EventId{0, false});
  for (int i = 0; i < 500; ++i) happen();
  EXPECT_LT(stream->next()->size(), 200'000u);
}

TEST_F(AFeed, GivesTheNewestJointsAtMostFiveTimesASecondAndWithoutANumber) {
  happen();
  const auto stream = feed.follow({});
  take(*stream);
  int given = 0;
  double newest = 0.0;
  for (int ms = 0; ms < 2000; ms += 10) {
    now += std::chrono::milliseconds(10);
    move(0.001 * ms);
    for (const Event& event : take(*stream)) {
      EXPECT_EQ(event.name, "robot");
      EXPECT_EQ(event.id, "");
      EXPECT_EQ(event.data["session"], 3);
      newest = event.data["joints_deg"][0];
      ++given;
    }
  }
  EXPECT_GE(given, 5);
  EXPECT_LE(given, 10);
  EXPECT_NEAR(newest, 1.9 * 57.29577951, 12.0);
}

TEST_F(AFeed, GivesNoJointsThatNoPacketShows) {
  happen();
  const auto stream = feed.follow({});
  take(*stream);
  for (const auto link : {drivers::RobotLink::kDown, drivers::RobotLink::kLost}) {
    now += std::chrono::seconds(1);
    move(0.5, link);
    EXPECT_TRUE(take(*stream).empty());
  }
  now += std::chrono::seconds(1);
  move(0.5, drivers::RobotLink::kNotReferenced);
  EXPECT_EQ(take(*stream).size(), 1u);
}

TEST_F(AFeed, ThatIsQuietSaysNowAndThenThatItLives) {
  const auto stream = feed.follow({});
  take(*stream);
  EXPECT_EQ(*stream->next(), "");
  now += std::chrono::seconds(6);
  EXPECT_EQ(*stream->next(), ":\n\n");
  EXPECT_EQ(*stream->next(), "");
}

TEST(AnEventId, IsANumberWithOrWithoutItsTouch) {
  EXPECT_EQ(parse_event_id("57")->seq, 57u);
  EXPECT_FALSE(parse_event_id("57")->touch);
  EXPECT_TRUE(parse_event_id("57.1")->touch);
  for (const char* wrong : {"", "x", "-1", "1.2", "1.", ".1", " 1", "1 ", "1e3", "1.1.1",
                            "99999999999999999999", "0x1"}) {
    EXPECT_FALSE(parse_event_id(wrong)) << wrong;
  }
}

}  // namespace
}  // namespace cellcal::daemon
