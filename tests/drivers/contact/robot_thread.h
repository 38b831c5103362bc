#pragma once
// SerialContact with a thread that polls its guard, as a robot's would. Waits have generous limits.

#include <gtest/gtest.h>

#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <cstdlib>
#include <functional>
#include <future>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "drivers/contact/serial_contact.h"

namespace cellcal::drivers {

using std::chrono::milliseconds;
using Steady = std::chrono::steady_clock;

inline bool wait_for(const std::function<bool()>& done,
                     std::chrono::seconds limit = std::chrono::seconds{20}) {
  const auto end = Steady::now() + limit;
  while (!done()) {
    if (Steady::now() > end) return false;
    std::this_thread::sleep_for(milliseconds{1});
  }
  return true;
}

/// The robot's thread: an io_context that polls the guard every millisecond.
class RobotThread {
 public:
  explicit RobotThread(SerialContactOptions options)
      : guard_(boost::asio::make_work_guard(io)), contact(io, options), timer_(io) {
    thread_ = std::thread([this] {
      cycle();
      io.run();
    });
  }
  ~RobotThread() {
    contact.close();
    io.stop();
    thread_.join();
  }

  std::optional<ContactEvent> find(ContactEventKind kind, std::uint16_t arm_id) const {
    const std::lock_guard lock(mutex_);
    for (const ContactEvent& e : events_) {
      if (e.kind == kind && e.arm_id == arm_id) return e;
    }
    return std::nullopt;
  }
  void forget_events() {
    const std::lock_guard lock(mutex_);
    events_.clear();
  }
  ContactSnapshot snapshot() const {
    const std::lock_guard lock(mutex_);
    return snapshot_;
  }
  bool ready() {
    return wait_for([this] { return contact.status().link == ContactLink::kReady; });
  }
  /// Blocks the I/O thread until the returned promise is fulfilled.
  std::promise<void> hold() {
    std::promise<void> go, held;
    auto until = std::make_shared<std::future<void>>(go.get_future());
    auto holds = held.get_future();
    auto said = std::make_shared<std::promise<void>>(std::move(held));
    boost::asio::post(io, [until, said] {
      said->set_value();
      until->wait();
    });
    holds.wait();
    return go;
  }
  ArmResult arm(std::uint16_t id) {
    contact.arm(id, std::chrono::seconds{30});
    std::optional<ArmResult> result;
    EXPECT_TRUE(wait_for([&] { return (result = contact.poll_arm()).has_value(); }));
    return result.value_or(ArmResult{});
  }

 private:
  void cycle() {
    {
      const std::lock_guard lock(mutex_);
      snapshot_ = contact.guard().snapshot(Steady::now());
      while (const auto e = contact.guard().pop_event()) events_.push_back(*e);
    }
    timer_.expires_after(milliseconds{1});
    timer_.async_wait([this](boost::system::error_code error) {
      if (!error) cycle();
    });
  }

  boost::asio::io_context io;
  boost::asio::executor_work_guard<boost::asio::io_context::executor_type> guard_;

 public:
  SerialContact contact;

 private:
  boost::asio::steady_timer timer_;
  mutable std::mutex mutex_;
  ContactSnapshot snapshot_;
  std::vector<ContactEvent> events_;
  std::thread thread_;
};

inline SerialContactOptions options_for(const PortOptions& port) {
  SerialContactOptions options;
  options.port = port;
  options.contact.max_clock_sigma_s = 0.02;  // tolerates a loaded test machine
  options.reopen_first = milliseconds{20};
  options.reopen_longest = milliseconds{100};
  return options;
}

inline SerialContactOptions options_for(const std::string& device) {
  // ctest runs all tests a second time on the code path of real devices, with pty_shim preloaded.
  return options_for(
      PortOptions{.device = device,
                  .always_libserialport = std::getenv("CELLCAL_TEST_LIBSERIALPORT") != nullptr});
}

/// With the port open, for tests of its backends.
struct RobotSide : RobotThread {
  explicit RobotSide(const PortOptions& port) : RobotThread(options_for(port)) { contact.open(); }
  ContactStatus status() const { return contact.status(); }
  /// For some heartbeats; a failed read would be repeated immediately.
  bool stays_ready() {
    for (int i = 0; i < 100; ++i) {
      if (status().link != ContactLink::kReady) return false;
      std::this_thread::sleep_for(milliseconds{5});
    }
    return true;
  }
  bool arms() {
    std::uint16_t id = 0;
    return wait_for([&] { return arm(++id).armed; });
  }
};

/// A touch of the emulated sensor `board`, which the robot's contact is open to. A busy machine may delay the
/// heartbeat, which correctly ends the arming: retried.
template <class Board>
void expect_touch_with_its_time(RobotThread& robot, Board& board) {
  std::optional<ContactEvent> contact;
  TimePoint touch;
  std::uint16_t id = 0;
  for (int attempt = 0; attempt < 10 && !contact; ++attempt) {
    ASSERT_TRUE(robot.ready()) << robot.contact.status().words;
    if (!robot.arm(++id).armed) continue;
    touch = Steady::now() + milliseconds{8};
    board.edge(touch, true);
    ASSERT_TRUE(wait_for([&] {
      return robot.find(ContactEventKind::kContact, id) ||
             robot.find(ContactEventKind::kContact, 0);
    }));
    contact = robot.find(ContactEventKind::kContact, id);
    if (contact) break;
    robot.forget_events();
    board.edge(Steady::now(), false);
    ASSERT_TRUE(wait_for([&] { return !robot.snapshot().in_contact; }));
  }
  ASSERT_TRUE(contact) << robot.contact.status().words;
  EXPECT_TRUE(robot.find(ContactEventKind::kTrip, id));
  const double off_s = std::chrono::duration<double>(contact->first_edge - touch).count();
  EXPECT_LT(std::abs(off_s), 6.0 * contact->time_sigma_s) << "sigma " << contact->time_sigma_s;
  EXPECT_TRUE(robot.snapshot().in_contact);
  EXPECT_FALSE(robot.snapshot().armed);
}

}  // namespace cellcal::drivers
