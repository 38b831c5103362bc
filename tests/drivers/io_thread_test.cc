#include "drivers/io_thread.h"

#include <gtest/gtest.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <chrono>
#include <future>
#include <thread>

namespace cellcal::drivers {
namespace {

using namespace std::chrono_literals;

IoThreadOptions plain() { return {.realtime = false, .quiet = true}; }

bool goes_on(const IoThread& io) {
  const std::uint64_t before = io.beats();
  for (int i = 0; i < 1000; ++i) {
    if (io.beats() != before) return true;
    std::this_thread::sleep_for(10ms);
  }
  return false;
}

TEST(IoThread, CountsWhileItRunsHandlersThoughNobodyAsksForAny) {
  IoThread io(plain());
  EXPECT_EQ(io.beats(), 0u);
  io.start();
  EXPECT_TRUE(goes_on(io));
  io.stop();
  const std::uint64_t at_end = io.beats();
  std::this_thread::sleep_for(250ms);
  EXPECT_EQ(io.beats(), at_end);
}

TEST(IoThread, AHandlerThatDoesNotReturnEndsTheCountAndItGoesOnBehindIt) {
  IoThread io(plain());
  io.start();
  std::promise<void> entered, leave;
  boost::asio::post(io.context(), [&] {
    entered.set_value();
    leave.get_future().wait();
  });
  entered.get_future().wait();
  const std::uint64_t held = io.beats();
  std::this_thread::sleep_for(250ms);
  EXPECT_EQ(io.beats(), held);
  leave.set_value();
  EXPECT_TRUE(goes_on(io));
}

}  // namespace
}  // namespace cellcal::drivers
