#pragma once
// Waiting for an expected event on a possibly loaded machine.

#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <chrono>
#include <future>
#include <thread>

namespace cellcal::drivers {

/// Sufficient for any machine; reached only on failure.
inline constexpr std::chrono::seconds kTimeout{20};

template <typename Condition>
bool eventually(Condition condition) {
  const auto end = std::chrono::steady_clock::now() + kTimeout;
  while (!condition()) {
    if (std::chrono::steady_clock::now() > end) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return true;
}

/// Result of `ask` on the context's thread.
template <typename Ask>
auto asked_on(boost::asio::io_context& context, Ask ask) {
  std::promise<decltype(ask())> answer;
  auto answered = answer.get_future();
  boost::asio::post(context, [&] { answer.set_value(ask()); });
  return answered.get();
}

}  // namespace cellcal::drivers
