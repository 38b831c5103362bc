#include "daemon/api/attempts.h"

#include <algorithm>

#include "daemon/api/http/same_site.h"

namespace cellcal::daemon {

namespace {

constexpr std::chrono::minutes kForgotten{10};
constexpr std::chrono::milliseconds kFirstWait{100}, kLongestWait{5'000};
constexpr int kMostDoublings = 6;
constexpr std::size_t kMostAddresses = 1000;

}  // namespace

FailedAttempts::Count FailedAttempts::add(const std::string& address) {
  const auto now = clock_();
  std::erase_if(of_, [&](const auto& one) { return now - one.second.last > kForgotten; });
  if (of_.size() >= kMostAddresses) {
    of_.erase(std::min_element(of_.begin(), of_.end(), [](const auto& a, const auto& b) {
      return a.second.last < b.second.last;
    }));
  }
  Of& one = of_[network_of(address)];
  one.last = now;
  one.count = std::min(one.count + 1, 1'000'000);
  const auto wait = kFirstWait * (1 << std::min(one.count - 1, kMostDoublings));
  return {one.count, std::min(wait, kLongestWait)};
}

}  // namespace cellcal::daemon
