#include "daemon/plant/line/cell_metrics.h"

#include <cmath>
#include <utility>

#include "calib/model/units.h"

namespace cellcal::daemon::plant::sparkplug {

namespace {

using calib::kMmPerM, calib::kMsPerS;

/// Optional part of the cell's state: when missing, each of its metrics is null.
template <class Part>
class Group {
 public:
  Group(std::vector<Metric>& all, std::string name, const Part* part)
      : all_(all), name_(std::move(name)), part_(part) {}

  template <class Get>
  Group& put(const char* name, DataType type, Get get) {
    Metric metric{name_ + "/" + name, type, {}};
    if (part_ != nullptr) set(metric, get(*part_));
    all_.push_back(std::move(metric));
    return *this;
  }

 private:
  template <class T>
  static void set(Metric& metric, const T& value) {
    metric.value = value;
  }
  template <class T>
  static void set(Metric& metric, const std::optional<T>& value) {
    if (value) metric.value = *value;
  }

  std::vector<Metric>& all_;
  std::string name_;
  const Part* part_;
};

template <class Part>
const Part* pointer(const std::optional<Part>& part) {
  return part ? &*part : nullptr;
}

std::int64_t milliseconds(double time_s) { return std::llround(time_s * kMsPerS); }

std::optional<double> millimetres(const std::optional<double>& metres) {
  return metres ? std::optional(*metres * kMmPerM) : std::nullopt;
}

}  // namespace

std::vector<Metric> metrics_of(const CellNow& now) {
  using enum DataType;
  std::vector<Metric> all;
  Group(all, "Properties", &now)
      .put("Software", kString, [](const CellNow& cell) { return cell.software; })
      .put("Emulated", kBoolean, [](const CellNow& cell) { return cell.emulated; });
  Group(all, "State", &now)
      .put("Phase", kString, [](const CellNow& cell) { return cell.phase; })
      .put("Running", kBoolean, [](const CellNow& cell) { return cell.running; });
  using Session = CellNow::Session;
  Group(all, "Session", pointer(now.session))
      .put("Number", kInt64, [](const Session& session) { return session.number; })
      .put("Kind", kString, [](const Session& session) { return session.kind; })
      .put("Touches", kInt64, [](const Session& session) { return session.touches; })
      .put("Touches planned", kInt64, [](const Session& session) { return session.planned; })
      .put("Failure", kString, [](const Session& session) { return session.failure; });
  using InUse = CellNow::InUse;
  Group(all, "Calibration", pointer(now.calibration))
      .put("Session", kInt64, [](const InUse& in_use) { return in_use.session; })
      .put("Time", kDateTime,
           [](const InUse& in_use) {
             return in_use.time_s ? std::optional(milliseconds(*in_use.time_s)) : std::nullopt;
           })
      .put("Scope", kString,
           [](const InUse& in_use) -> std::string {
             return in_use.workspace ? "workspace" : "targets";
           })
      .put("Predicted error mm", kDouble,
           [](const InUse& in_use) { return in_use.predicted_m * kMmPerM; })
      .put("u95 mm", kDouble, [](const InUse& in_use) { return millimetres(in_use.u95_m); });
  using Check = CellNow::Check;
  Group(all, "Check", pointer(now.check))
      .put("Session", kInt64, [](const Check& check) { return check.session; })
      .put("Time", kDateTime, [](const Check& check) { return milliseconds(check.time_s); })
      .put("Holds", kBoolean, [](const Check& check) { return check.holds; })
      .put("TCP shift mm", kDouble, [](const Check& check) { return millimetres(check.shift_m); });
  Group(all, "Drift", &now)
      .put("State", kString, [](const CellNow& cell) { return cell.drift_state; })
      .put("Advice", kString, [](const CellNow& cell) { return cell.drift_advice; });
  using Link = CellNow::Link;
  Group(all, "Link", pointer(now.link))
      .put("Open", kBoolean, [](const Link& link) { return link.open; })
      .put("Robot late replies", kInt64, [](const Link& link) { return link.late; })
      .put("Robot missing packets", kInt64, [](const Link& link) { return link.missing; })
      .put("Sensor damaged frames", kInt64, [](const Link& link) { return link.damaged; });
  return all;
}

}  // namespace cellcal::daemon::plant::sparkplug
