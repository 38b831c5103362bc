#include "sim/krc/eki_stream.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "drivers/kuka/wire/xml_values.h"
#include "drivers/units.h"

namespace cellcal::sim {

namespace {

namespace wire = drivers::wire;
using drivers::Duration;
using drivers::TimePoint;

using drivers::kDegPerRad;
using drivers::kRadPerDeg;
constexpr double kUsualSpeed = 3.0;
constexpr double kBlendRad = 2.0 * kRadPerDeg;
constexpr std::string_view kFrameNames = "XYZABC";
constexpr std::chrono::milliseconds kReopen{100};

/// "RobotState/Pos/@A1": "A1" of "RobotState/Pos".
struct Place {
  std::string parent, name;
};
Place place_of(const std::string& path) {
  const std::size_t slash = path.rfind('/');
  Place place{path.substr(0, slash == std::string::npos ? 0 : slash), path.substr(slash + 1)};
  if (place.name.starts_with('@')) place.name.erase(0, 1);
  return place;
}

/// A1 is 0, E1 is 6; empty otherwise.
std::optional<std::size_t> axis_of(const std::string& name) {
  const bool numbered = name.size() == 2 && name[1] >= '1' && name[1] <= '6';
  if (!numbered || (name[0] != 'A' && name[0] != 'E')) return std::nullopt;
  return static_cast<std::size_t>(name[1] - '1') + (name[0] == 'E' ? 6 : 0);
}

std::optional<std::size_t> frame_index_of(const std::string& name) {
  const std::size_t at = name.size() == 1 ? kFrameNames.find(name[0]) : std::string_view::npos;
  return at == std::string_view::npos ? std::nullopt : std::optional(at);
}

}  // namespace

bool is_cellcal_channel(const EkiChannelConfig& channel) {
  // All of them: other software numbers its commands as well, and its Type="2" is not our beat.
  constexpr std::string_view kOurs[] = {
      "RobotCommand/@Session",      "RobotCommand/@Seq",          "RobotCommand/@Type",
      "RobotCommand/@Id",           "RobotCommand/Move/@Guard",   "RobotCommand/Move/@Path",
      "RobotCommand/Move/@Percent", "RobotCommand/Move/@Duration"};
  return std::all_of(std::begin(kOurs), std::end(kOurs), [&](std::string_view ours) {
    return std::any_of(channel.receive.begin(), channel.receive.end(),
                       [&](const auto& element) { return wire::same_name(element.first, ours); });
  });
}

struct EkiStream::Impl {
  struct Served {
    explicit Served(const std::string& xml) : channel(EkiChannelConfig::parse(xml)) {
      for (const auto& [path, type] : channel.config().receive) {
        const std::string name = place_of(path).name;
        const bool of_target = axis_of(name) || frame_index_of(name);
        if (wire::same_name(name, "Type")) type_path = lead = path;
        known_cart = known_cart || wire::same_name(path, "RobotCommand/Cart/@X");
        known_axis = known_axis || wire::same_name(path, "RobotCommand/Axis/@A1");
        if (axis_of(name)) default_type = 1;
        if (of_target && lead.empty()) lead = path;
      }
      for (const std::string& path : channel.config().send) {
        const std::string root = path.substr(0, path.find('/'));
        if (std::find(roots.begin(), roots.end(), root) == roots.end()) roots.push_back(root);
      }
      channel.open();
    }
    EkiChannel channel;
    std::string lead;       ///< a queued value of it means a queued command; empty: accepts none
    std::string type_path;  ///< empty: every command is of the default type
    bool known_axis = false, known_cart = false;
    /// The codes 1 to 5 belong to one program, identified by the names of its elements. Other
    /// programs' Type may have any meaning.
    bool knows_types() const {
      return type_path.empty() ||
             (known_axis && known_cart && wire::same_name(type_path, "RobotCommand/Type"));
    }
    int default_type = 2;  ///< PTP to angles if the file has any, otherwise to the TCP
    std::vector<std::string> roots;
    bool was_connected = false;
    TimePoint reopen_at{};
  };

  explicit Impl(EkiStreamConfig c) : config(std::move(c)) {
    axes = config.start_rad.size();
    if (axes == 0 || axes > 12) throw std::invalid_argument("emulated EKI: 1 to 12 axes");
    if (config.channel_xml.empty()) throw std::invalid_argument("emulated EKI: no channel file");
    if (config.cycle_ms <= 0 || config.state_ms % config.cycle_ms != 0 || !(config.lag_s > 0.0)) {
      throw std::invalid_argument(
          "emulated EKI: state_ms must be a multiple of cycle_ms, lag_s positive");
    }
    if (config.max_speed_rad_s.empty()) config.max_speed_rad_s.assign(axes, kUsualSpeed);
    if (config.max_speed_rad_s.size() != axes)
      throw std::invalid_argument("emulated EKI: max_speed_rad_s needs one per axis");
    for (const std::string& xml : config.channel_xml)
      served.push_back(std::make_unique<Served>(xml));
    setpoint = target = actual = config.start_rad;
    speed.assign(axes, 0.0);
  }

  // ---- commands --------------------------------------------------------------------------------

  double far() const {
    double most = 0.0;
    for (std::size_t i = 0; i < axes; ++i) most = std::max(most, std::abs(target[i] - setpoint[i]));
    return most;
  }
  bool at_rest() const {
    return far() == 0.0 && std::all_of(speed.begin(), speed.end(), [](double v) { return v == 0; });
  }

  void read_commands() {
    for (const auto& s : served) {
      if (s->lead.empty()) continue;
      const bool free = at_rest() || (s->type_path.empty() && far() < kBlendRad);
      if (free && s->channel.waiting(s->lead) > 0) take(*s);
    }
  }

  void take(Served& s) {
    int type = s.default_type;
    double velocity = 1.0;
    std::vector<std::optional<double>> axis_deg(axes);
    KukaFrame frame{};
    for (const auto& [path, kind] : s.channel.config().receive) {
      const std::optional<double> value = s.channel.get(path);
      if (!value) continue;
      const std::string name = place_of(path).name;
      if (const auto axis = axis_of(name); axis && *axis < axes) axis_deg[*axis] = *value;
      if (const auto index = frame_index_of(name)) frame[*index] = *value;
      if (path == s.type_path) type = static_cast<int>(*value);
      if (wire::same_name(name, "Velocity")) velocity = *value > 1.0 ? *value / 100.0 : *value;
    }
    message.clear();
    if (!s.knows_types()) {
      message = s.type_path + " is not a Type whose codes are known here: nothing is moved by it";
      return;
    }
    const auto next = target_of(type, axis_deg, frame);
    if (!next) return;
    for (std::size_t i = 0; i < axes; ++i) {
      const bool below = i < config.min_rad.size() && (*next)[i] < config.min_rad[i];
      const bool above = i < config.max_rad.size() && (*next)[i] > config.max_rad[i];
      if (below || above) {
        message = "Software limit switch of axis " + std::to_string(i + 1);
        return;
      }
    }
    target = *next;
    scale = std::clamp(velocity, 0.01, 1.0);
    ++moves;
  }

  std::optional<std::vector<double>> target_of(int type,
                                               const std::vector<std::optional<double>>& axis_deg,
                                               const KukaFrame& frame) {
    if (type == 1 || type == 4) {
      std::vector<double> next = target;
      for (std::size_t i = 0; i < axes; ++i) {
        if (axis_deg[i]) next[i] = *axis_deg[i] * kRadPerDeg + (type == 4 ? target[i] : 0.0);
      }
      return next;
    }
    if (type < 1 || type > 5) {
      message = "Type " + std::to_string(type) + " is not known";
      return std::nullopt;
    }
    std::optional<std::vector<double>> next;
    if (config.arm) {
      next = type == 5 ? config.arm->corrected(target, frame, CorrectionFrame::kBase, target)
                       : config.arm->axes(frame, target);
    }
    if (!next) message = "Work envelope exceeded";
    return next;
  }

  void move() {
    const double dt = 1e-3 * config.cycle_ms;
    const double step = config.max_acceleration_rad_s2 * dt;
    for (std::size_t i = 0; i < axes; ++i) {
      const double left = target[i] - setpoint[i];
      // With discrete steps the ramp to the target has to begin one step early.
      const double stops =
          std::max(std::sqrt(2.0 * config.max_acceleration_rad_s2 * std::abs(left)) - step, step);
      const double most = std::min(config.max_speed_rad_s[i] * scale, stops);
      const double wanted = left > 0.0 ? most : left < 0.0 ? -most : 0.0;
      speed[i] = std::clamp(wanted, speed[i] - step, speed[i] + step);
      if (std::abs(left) <= std::abs(speed[i]) * dt && std::abs(speed[i]) <= 2.0 * step) {
        setpoint[i] = target[i];
        speed[i] = 0.0;
      } else {
        setpoint[i] += speed[i] * dt;
      }
    }
  }

  // ---- states ----------------------------------------------------------------------------------

  std::size_t waiting() const {
    std::size_t most = 0;
    for (const auto& s : served) {
      if (!s->lead.empty()) most = std::max(most, s->channel.waiting(s->lead));
    }
    return most;
  }

  /// S: bit 1 A3 above 0, bit 2 A5 below 0; T: one bit per negative axis.
  int status() const {
    return (axes > 2 && actual[2] >= 0.0 ? 2 : 0) + (axes > 4 && actual[4] < 0.0 ? 4 : 0);
  }
  int turn() const {
    int bits = 0;
    for (std::size_t i = 0; i < std::min<std::size_t>(axes, 6); ++i)
      bits |= actual[i] < 0.0 ? 1 << i : 0;
    return bits;
  }

  std::string value_of(const Place& place, const KukaFrame& tcp) const {
    const std::string parent = wire::lower(place.parent);
    const bool of_speed = parent.find("vel") != std::string::npos;
    const bool of_load =
        parent.find("eff") != std::string::npos || parent.find("torque") != std::string::npos;
    const auto axis = axis_of(place.name);
    if (of_load) return eki_real(0.0);
    if (axis && of_speed)
      return eki_real(*axis < axes ? 100.0 * speed[*axis] / config.max_speed_rad_s[*axis] : 0.0);
    if (axis) return eki_real(*axis < axes ? actual[*axis] * kDegPerRad : 0.0);
    if (const auto index = frame_index_of(place.name)) return eki_real(tcp[*index]);
    if (place.name == "S") return std::to_string(status());
    if (place.name == "T") return std::to_string(turn());
    if (wire::same_name(place.name, "Size")) return std::to_string(waiting());
    return "0";
  }

  void send_states() {
    const KukaFrame tcp = config.arm ? config.arm->frame(actual) : KukaFrame{};
    for (const auto& s : served) {
      for (const std::string& path : s->channel.config().send)
        s->channel.set(path, value_of(place_of(path), tcp));
      for (const std::string& root : s->roots) s->channel.send(root);
    }
  }

  void watch_connections(TimePoint now) {
    for (const auto& s : served) {
      if (s->was_connected && !s->channel.connected()) {
        s->channel.clear();
        s->reopen_at = now + kReopen;
      }
      s->was_connected = s->channel.connected();
      if (!s->was_connected && now >= s->reopen_at) s->channel.open();
    }
  }

  void tick(TimePoint now) {
    actual = actual_at(now);
    tick_at = now;
    watch_connections(now);
    read_commands();
    move();
    if (cycles++ % static_cast<std::uint64_t>(config.state_ms / config.cycle_ms) == 0)
      send_states();
  }

  std::vector<double> actual_at(TimePoint t) const {
    const double dt = std::max(0.0, std::chrono::duration<double>(t - tick_at).count());
    const double moved = tick_at == TimePoint{} ? 0.0 : -std::expm1(-dt / config.lag_s);
    std::vector<double> position = actual;
    for (std::size_t i = 0; i < axes; ++i) position[i] += moved * (setpoint[i] - actual[i]);
    return position;
  }

  EkiStreamConfig config;
  std::size_t axes = 0;
  std::vector<std::unique_ptr<Served>> served;
  std::vector<double> setpoint, target, actual, speed;
  double scale = 1.0;
  TimePoint tick_at{};
  std::uint64_t cycles = 0, moves = 0;
  std::string message;
};

EkiStream::EkiStream(EkiStreamConfig config) : impl_(std::make_unique<Impl>(std::move(config))) {}
EkiStream::~EkiStream() = default;

void EkiStream::tick(TimePoint now) { impl_->tick(now); }
Duration EkiStream::cycle() const { return std::chrono::milliseconds(impl_->config.cycle_ms); }
std::size_t EkiStream::channels() const { return impl_->served.size(); }
EkiChannel& EkiStream::channel(std::size_t i) { return impl_->served.at(i)->channel; }

void EkiStream::datagram(std::size_t i, std::string_view bytes) {
  EkiChannel& served = channel(i);
  if (!served.connected() && !served.connect()) return;
  served.receive(bytes);
}

std::vector<double> EkiStream::actual_rad_at(TimePoint t) const { return impl_->actual_at(t); }
std::vector<double> EkiStream::setpoint_rad() const { return impl_->setpoint; }
bool EkiStream::at_rest() const { return impl_->at_rest(); }
std::uint64_t EkiStream::moves() const { return impl_->moves; }
const std::string& EkiStream::message() const { return impl_->message; }

}  // namespace cellcal::sim
