#include "daemon/plant/line/payload.h"

#include <algorithm>

#include "sparkplug_b.pb.h"

namespace cellcal::daemon::plant::sparkplug {

namespace {

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
