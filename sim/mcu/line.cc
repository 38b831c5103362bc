#include "sim/mcu/line.h"

#include <algorithm>

namespace cellcal::sim {

using drivers::TimePoint;

Line::Line(LineKind kind, drivers::Duration transit, std::uint64_t seed)
    : kind_(kind), transit_(transit), random_(seed) {}

void Line::add(Trouble trouble) { line_faults_.push_back(std::move(trouble)); }

void Line::put(TimePoint t, std::string bytes, bool in_order) {
  if (in_order) last_arrival_ = t = std::max(t, last_arrival_);
  const auto behind = std::upper_bound(under_way_.begin(), under_way_.end(), t,
                                       [](TimePoint a, const Message& b) { return a < b.t; });
  under_way_.insert(behind, {t, std::move(bytes)});
}

void Line::damage(std::string& bytes) {
  if (bytes.empty()) return;
  char& byte = bytes[std::uniform_int_distribution<std::size_t>(0, bytes.size() - 1)(random_)];
  // A different value: adding 1..255 never gives the old one.
  byte = static_cast<char>(static_cast<unsigned char>(byte) +
                           std::uniform_int_distribution<unsigned>(1, 255)(random_));
}

void Line::send(std::string_view sent, TimePoint t) {
  if (sent.empty() || ended_) return;
  std::string bytes(sent);
  TimePoint arrival = t + transit_;
  bool in_order = true, touched = false;
  std::optional<drivers::Duration> again;
  for (Trouble& trouble : line_faults_) {
    if (t < trouble.from || t >= trouble.until || trouble.most == 0) continue;
    if (trouble.share < 1.0 &&
        std::uniform_real_distribution<double>(0.0, 1.0)(random_) >= trouble.share) {
      continue;
    }
    if (trouble.most > 0) --trouble.most;
    if (!touched) ++touched_;
    touched = true;
    switch (trouble.kind) {
      case LineFaultKind::kDrop:
        if (kind_ != LineKind::kStream) return;
        arrival += kRepeatTime;
        break;
      case LineFaultKind::kCut:
        if (kind_ != LineKind::kStream || trouble.until == TimePoint::max()) return;
        arrival = std::max(arrival, trouble.until + kRepeatTime);
        break;
      case LineFaultKind::kDelay:
        arrival += trouble.delay;
        break;
      case LineFaultKind::kDuplicate:
        again = trouble.delay;
        break;
      case LineFaultKind::kReorder:
        arrival += trouble.delay;
        in_order = kind_ != LineKind::kDatagrams;
        break;
      case LineFaultKind::kCorrupt:
        damage(bytes);
        break;
      case LineFaultKind::kTruncate:
        bytes.resize(std::uniform_int_distribution<std::size_t>(0, bytes.size() - 1)(random_));
        if (kind_ == LineKind::kStream) ended_ = arrival;
        break;
      case LineFaultKind::kRewrite:
        trouble.rewrite(bytes);
        break;
    }
  }
  put(arrival, bytes, in_order);
  if (again) put(arrival + *again, std::move(bytes), kind_ != LineKind::kDatagrams);
}

TimePoint Line::next() const {
  return under_way_.empty() ? TimePoint::max() : under_way_.front().t;
}

std::optional<Line::Message> Line::take(TimePoint now) {
  if (under_way_.empty() || under_way_.front().t > now) return std::nullopt;
  Message oldest = std::move(under_way_.front());
  under_way_.pop_front();
  return oldest;
}

bool Line::is_cut(TimePoint t) const {
  return std::any_of(line_faults_.begin(), line_faults_.end(), [t](const Trouble& trouble) {
    return trouble.kind == LineFaultKind::kCut && t >= trouble.from && t < trouble.until;
  });
}

void Line::restart() {
  under_way_.clear();
  last_arrival_ = TimePoint{};
  ended_.reset();
}

}  // namespace cellcal::sim
