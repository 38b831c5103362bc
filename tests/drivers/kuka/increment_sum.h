#pragma once
// RSI_ON(#RELATIVE) with HOLDON=0 in front of the emulated controller: takes increments, adds up
// those that come in time with the right SENTYPE and IPOC, and hands their sum on as the absolute
// correction that it is. A cycle without a reply adds nothing.

#include <algorithm>
#include <array>
#include <string>
#include <vector>

#include "drivers/kuka/rsi_codec.h"

namespace cellcal::drivers {

class IncrementSum {
 public:
  /// A reply to the packet with this IPOC. Returns what the absolute controller is to hear.
  std::string absolute(const std::string& reply, std::uint64_t ipoc) {
    if (parser_.parse_sen(reply, names_, frame_) != WireError::kNone ||
        frame_.ipoc.text.view() != std::to_string(ipoc)) {
      return {};
    }
    if (ipoc != ipoc_) {  // the cycle before is over: what it brought is in force
      ipoc_ = ipoc;
      before_ = sum_deg;
    }
    increments_deg.assign(frame_.axes_deg.begin(), frame_.axes_deg.end());
    for (std::size_t i = 0; i < sum_deg.size(); ++i) sum_deg[i] = before_[i] + increments_deg[i];
    std::array<char, kRsiBuffer> buffer{};
    return std::string(format_sen(names_, sum_deg, 9, frame_.stop, std::to_string(ipoc), buffer));
  }
  /// RSI_ON.
  void reset() { sum_deg.assign(6, 0.0); }

  std::vector<double> sum_deg = std::vector<double>(6, 0.0);
  std::vector<double> increments_deg = std::vector<double>(6, 0.0);  ///< of the newest reply

 private:
  SenNames names_;
  RsiParser parser_;
  SenFrame frame_;
  std::uint64_t ipoc_ = 0;
  std::vector<double> before_ = sum_deg;
};

}  // namespace cellcal::drivers
