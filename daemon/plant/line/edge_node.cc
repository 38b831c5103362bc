#include "daemon/plant/line/edge_node.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <boost/asio/post.hpp>

#include "daemon/plant/line/mqtt_line.h"
#include "daemon/runner/backend.h"
#include "sparkplug_b.pb.h"

namespace cellcal::daemon::plant::sparkplug {

namespace asio = boost::asio;

namespace {

std::uint64_t now_ms() {
  return static_cast<std::uint64_t>(std::chrono::duration_cast<std::chrono::milliseconds>(
                                        std::chrono::system_clock::now().time_since_epoch())
                                        .count());
}

namespace wire = cellcal::sparkplug;

constexpr std::size_t kLargestCommand = std::size_t{1} << 16;

struct PutValue {
  wire::Metric& to;
  void operator()(std::monostate) const { to.set_is_null(true); }
  /// Two's complement, as defined by the standard.
  void operator()(std::int64_t value) const {
    to.set_long_value(static_cast<std::uint64_t>(value));
  }
  void operator()(double value) const { to.set_double_value(value); }
  void operator()(bool value) const { to.set_boolean_value(value); }
  void operator()(const std::string& value) const { to.set_string_value(value); }
};

}  // namespace

struct EdgeNode::Impl : LineThread {
  explicit Impl(Parts given)
      : LineThread(given.first_wait, given.longest_wait, "[plant]: Sparkplug"),
        parts(std::move(given)) {}

  std::string topic(const char* type) const {
    return "spBv1.0/" + parts.config.plant + "/" + type + "/" + parts.config.cell;
  }
  Metric line_number() const { return {"bdSeq", DataType::kInt64, std::int64_t{line_count}}; }
  MqttLine::Message death() const {
    return {topic("NDEATH"), payload({line_number()}, now_ms(), std::nullopt, Types::kDeclared)};
  }
  void connect() override;
  void up();
  void down(const LineFailure& lost);
  void schedule_poll();
  void poll();
  void bear();
  void send(const char* type, const std::vector<Metric>& metrics, Types types);
  void stop();

  Parts parts;
  asio::steady_timer tick{context};
  std::uint8_t line_count = 255;  ///< bdSeq: 0 on the first line
  std::uint8_t next_seq = 0;
  std::vector<Metric> published;  ///< as known to the host
  std::chrono::steady_clock::time_point up_since;
  std::optional<int> death_message;  ///< its message
  bool birth_wanted = false;
};

void EdgeNode::Impl::connect() {
  if (stopping) return;
  ++line_count;
  line = std::make_unique<MqttLine>(
      context, parts.config, death(),
      MqttLine::Events{[this] { up(); },
                       [this](int message, const std::optional<LineFailure>&) {
                         if (line && message == death_message) line->close();
                       },
                       [this](const std::string&, const std::string& command) {
                         if (asks_for_rebirth(command)) birth_wanted = true;
                       },
                       [this](const LineFailure& failure) { down(failure); }},
      MqttLine::Times{.keepalive = parts.keepalive}, "sparkplug");
}

void EdgeNode::Impl::up() {
  up_since = std::chrono::steady_clock::now();
  if (has_come_up())
    spdlog::info("[plant]: Sparkplug node {}/{} at {}:{}", parts.config.plant, parts.config.cell,
                 parts.config.host, parts.config.port);
  line->listen({topic("NCMD")});
  birth_wanted = true;
  poll();
}

void EdgeNode::Impl::down(const LineFailure& lost) {
  if (is_up && std::chrono::steady_clock::now() - up_since > parts.longest_wait) backoff.reset();
  tick.cancel();
  go_on_after(has_gone(lost, parts.config));
}

void EdgeNode::Impl::schedule_poll() {
  tick.expires_after(parts.every);
  tick.async_wait([this](boost::system::error_code cancelled) {
    if (!cancelled && is_up && !stopping) poll();
  });
}

/// Publishes changes; everything on request of a host, or for the first time.
void EdgeNode::Impl::poll() {
  schedule_poll();
  std::vector<Metric> now = parts.metrics();
  if (now.empty()) return;
  std::vector<Metric> changed;
  for (std::size_t i = 0; i < now.size(); ++i)
    if (i >= published.size() || now[i] != published[i]) changed.push_back(now[i]);
  published = std::move(now);
  if (std::exchange(birth_wanted, false))
    bear();
  else if (!changed.empty())
    send("NDATA", changed, Types::kKnown);
}

void EdgeNode::Impl::bear() {
  next_seq = 0;
  std::vector<Metric> all{line_number(), {kRebirth, DataType::kBoolean, false}};
  all.insert(all.end(), published.begin(), published.end());
  send("NBIRTH", all, Types::kDeclared);
}

/// A line that cannot carry it is closed, and the next one begins with a birth.
void EdgeNode::Impl::send(const char* type, const std::vector<Metric>& metrics, Types types) try {
  line->publish({topic(type), payload(metrics, now_ms(), next_seq, types), false,
                 MqttLine::Delivery::kAtMostOnce});
  ++next_seq;
  set([](LineStatus& now) { ++now.acknowledged; });
} catch (const NotPublished& lost) {
  spdlog::debug("[plant]: Sparkplug: {}", lost.what());
}

void EdgeNode::Impl::stop() {
  tick.cancel();
  if (!begin_farewell(parts.farewell)) return;
  try {
    death_message = line->publish(death());
  } catch (const NotPublished&) {  // the will is sent instead
    context.stop();
  }
}

EdgeNode::EdgeNode(Parts parts) : impl_(std::make_unique<Impl>(std::move(parts))) {
  impl_->start();
}

EdgeNode::~EdgeNode() {
  asio::post(impl_->context, [impl = impl_.get()] { impl->stop(); });
  impl_->thread.join();
}

void EdgeNode::close_with_will() {
  asio::post(impl_->context, [impl = impl_.get()] { impl->orderly = false; });
}

LineStatus EdgeNode::status() const { return impl_->status_now(); }

std::string payload(const std::vector<Metric>& metrics, std::uint64_t time_ms,
                    std::optional<std::uint8_t> seq, Types types) {
  wire::Payload whole;
  whole.set_timestamp(time_ms);
  for (const Metric& metric : metrics) {
    wire::Metric& one = *whole.add_metrics();
    one.set_name(metric.name);
    one.set_timestamp(time_ms);
    if (types == Types::kDeclared) one.set_datatype(static_cast<std::uint32_t>(metric.type));
    std::visit(PutValue{one}, metric.value);
  }
  if (seq) whole.set_seq(*seq);
  return whole.SerializeAsString();
}

bool asks_for_rebirth(std::string_view command) {
  wire::Payload whole;
  if (command.size() > kLargestCommand ||
      !whole.ParseFromArray(command.data(), static_cast<int>(command.size())))
    return false;
  return std::ranges::any_of(whole.metrics(), [](const wire::Metric& one) {
    return one.name() == kRebirth && one.boolean_value();
  });
}

}  // namespace cellcal::daemon::plant::sparkplug
