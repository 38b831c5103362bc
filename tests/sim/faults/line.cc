#include "tests/sim/faults/line.h"

#include <algorithm>
#include <array>

#include "drivers/contact/wire/ctp.h"

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
      case LineFaultKind::kDelay: arrival += trouble.delay; break;
      case LineFaultKind::kDuplicate: again = trouble.delay; break;
      case LineFaultKind::kReorder:
        arrival += trouble.delay;
        in_order = kind_ != LineKind::kDatagrams;
        break;
      case LineFaultKind::kCorrupt: damage(bytes); break;
      case LineFaultKind::kTruncate:
        bytes.resize(std::uniform_int_distribution<std::size_t>(0, bytes.size() - 1)(random_));
        if (kind_ == LineKind::kStream) ended_ = arrival;
        break;
      case LineFaultKind::kRewrite: trouble.rewrite(bytes); break;
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

SerialLine::SerialLine(drivers::ByteLine& device, std::uint64_t seed, LineKind kind)
    : device_(device), kind_(kind), to_device_(kind, {}, seed), to_host_(kind, {}, seed + 1) {}

void SerialLine::write(std::span<const std::uint8_t> bytes, TimePoint t) {
  const std::string text(bytes.begin(), bytes.end());
  to_device_.send(text, t);
  // Messages without transit time are delivered immediately, as without this line.
  advance(std::max(now_, t));
}

TimePoint SerialLine::next() const {
  return std::min({device_.next(), to_device_.next(), to_host_.next()});
}

void SerialLine::listen() {
  std::array<std::uint8_t, CTP_MAX_WIRE> bytes{};
  TimePoint t{};
  while (const std::size_t size = device_.read(bytes, t)) {
    to_host_.send(std::string(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size)), t);
  }
}

void SerialLine::advance(TimePoint t) {
  while (to_device_.next() <= t) {
    const TimePoint due = std::max(now_, to_device_.next());
    device_.advance(due);
    listen();
    now_ = due;
    const auto message = to_device_.take(due);
    const std::vector<std::uint8_t> bytes(message->bytes.begin(), message->bytes.end());
    device_.write(bytes, due);
  }
  device_.advance(t);
  listen();
  now_ = std::max(now_, t);
}

std::size_t SerialLine::read(std::span<std::uint8_t> into, TimePoint& t) {
  const auto message = to_host_.take(now_);
  if (!message) return 0;
  std::size_t size = std::min(message->bytes.size(), into.size());
  std::copy_n(message->bytes.begin(), size, into.begin());
  // As in the socket's reader: a truncated frame ends with its datagram.
  const bool cut = kind_ == LineKind::kDatagrams && size > 0 && into[size - 1] != 0;
  if (cut && size < into.size()) into[size++] = 0;
  t = message->t;
  // An empty datagram (truncated completely) must not be read as 'none pending'.
  return size > 0 ? size : read(into, t);
}

}  // namespace cellcal::sim
