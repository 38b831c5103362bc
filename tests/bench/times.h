#pragma once
// Samples of a time in microseconds, and their quantiles.

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <string>
#include <vector>

namespace cellcal::bench {

inline double microseconds(std::chrono::nanoseconds d) {
  return std::chrono::duration<double, std::micro>(d).count();
}

class Times {
 public:
  void add(double us) {
    us_.push_back(us);
    sorted_ = false;
  }
  void add(std::chrono::nanoseconds d) { add(microseconds(d)); }

  std::size_t count() const { return us_.size(); }
  /// Quantile p (0..1) of the samples; 0 without samples.
  double quantile(double p) {
    if (us_.empty()) return 0.0;
    if (!sorted_) std::sort(us_.begin(), us_.end());
    sorted_ = true;
    const auto at = static_cast<std::size_t>(p * static_cast<double>(us_.size()));
    return us_[std::min(us_.size() - 1, at)];
  }
  double worst() { return quantile(1.0); }

  /// p50, p99, p99.9, maximum and number of samples, as columns under columns().
  std::string row() {
    return fmt::format("{:9.1f} {:9.1f} {:9.1f} {:9.1f} {:8d}", quantile(0.5), quantile(0.99),
                       quantile(0.999), worst(), count());
  }
  static std::string columns() {
    return fmt::format("{:>9} {:>9} {:>9} {:>9} {:>8}", "p50", "p99", "p99.9", "worst", "samples");
  }

 private:
  std::vector<double> us_;
  bool sorted_ = false;
};

}  // namespace cellcal::bench
