#include "drivers/kuka/moves/move_queue.h"

#include <fmt/format.h>

#include "drivers/error.h"
#include "drivers/kuka/wire/wire_axes.h"

namespace cellcal::drivers {

CoreResult refusal_of(const Move& move, const Cause& why, const AxisAngles& at_rad,
                      MoveOutcome outcome) {
  CoreResult refusal;
  refusal.id = move.id;
  refusal.outcome = outcome;
  refusal.cause = why;
  refusal.at_rad = at_rad;
  return refusal;
}

namespace {

constexpr double kMostShare = 0.5;

std::optional<Cause> object_to(const AxisAngles& point_rad, std::span<const AxisLimit> limits) {
  if (point_rad.size() != limits.size()) return cause::AxisCount{point_rad.size(), limits.size()};
  const WireAxes axes(limits);
  for (std::size_t i = 0; i < limits.size(); ++i) {
    const WireAxis axis = axes.name(i);
    const double target = point_rad[i];
    const AxisLimit& limit = limits[i];
    if (!std::isfinite(target)) return cause::NotFinite{axis, target};
    if (target < limit.min_rad) {
      return cause::BelowLimit{axis, axes.shown(i, target), axes.shown(i, limit.min_rad)};
    }
    if (target > limit.max_rad) {
      return cause::AboveLimit{axis, axes.shown(i, target), axes.shown(i, limit.max_rad)};
    }
  }
  return std::nullopt;
}

std::optional<Cause> object_to(const Via& via) {
  for (const double share : {via.in_share, via.out_share}) {
    if (!(share >= 0.0 && share <= kMostShare)) return cause::BadShare{share, kMostShare};
  }
  return std::nullopt;
}

std::optional<Cause> object_to_kind(const Move& move) {
  if (!(move.speed_share > 0.0 && move.speed_share <= 1.0))
    return cause::BadShare{move.speed_share, 1.0};
  if (!std::isfinite(move.cruise_s) || move.cruise_s < 0.0) return cause::BadCruise{move.cruise_s};
  if (move.via.empty()) return std::nullopt;
  if (move.kind == MoveKind::kSearch) return cause::SearchByWayPoints{move.via.size()};
  if (move.cruise_s > 0.0) return cause::CruiseByWayPoints{move.cruise_s};
  return std::nullopt;
}

}  // namespace

Cause of_leg(Cause cause, const Move& move, std::size_t leg) {
  if (leg >= move.via.size()) return cause;
  std::visit(
      [&](auto& kind) {
        if constexpr (requires { kind.via; }) kind.via = static_cast<std::uint8_t>(leg + 1);
      },
      cause);
  return cause;
}

std::optional<Cause> object_to(const Move& move, std::span<const AxisLimit> limits) {
  // The target first, since every move has one.
  if (move.target_rad.size() != limits.size()) return object_to(move.target_rad, limits);
  if (const auto objection = object_to_kind(move)) return objection;
  for (std::size_t leg = 0; leg < leg_count(move); ++leg) {
    auto objection = object_to(leg_target(move, leg), limits);
    if (!objection && leg < move.via.size()) objection = object_to(move.via[leg]);
    if (objection) return of_leg(*objection, move, leg);
  }
  return std::nullopt;
}

std::optional<Cause> object_to(const Move& move, std::span<const AxisLimit> limits,
                               std::span<const double> correction_limit_deg,
                               const AxisAngles& base_rad) {
  if (const auto objection = object_to(move, limits)) return objection;
  const WireAxes axes(limits);
  for (std::size_t leg = 0; leg < leg_count(move); ++leg) {
    for (std::size_t i = 0; i < limits.size(); ++i) {
      const double correction_deg = axes.shown(i, leg_target(move, leg)[i] - base_rad[i]);
      if (std::abs(correction_deg) <= correction_limit_deg[i]) continue;
      const cause::CorrectionLimit beyond{axes.name(i), correction_deg, correction_limit_deg[i]};
      return of_leg(beyond, move, leg);
    }
  }
  return std::nullopt;
}

std::optional<Cause> object_to_travel(const Move& move, std::span<const AxisLimit> limits,
                                      const AxisAngles& at_rad, double tolerance_rad) {
  const WireAxes axes(limits);
  if (move.kind == MoveKind::kTransit) return std::nullopt;
  for (std::size_t i = 0; i < limits.size(); ++i) {
    const double target = leg_target(move, 0)[i];
    if (axes.place(i) < kArmAxes || std::abs(target - at_rad[i]) <= tolerance_rad) continue;
    return cause::TravelAtTarget{axes.name(i), axes.shown(i, at_rad[i]), axes.shown(i, target)};
  }
  return std::nullopt;
}

void check_linear_unit(const char* wire, std::span<const AxisLimit> limits) {
  for (std::size_t i = 0; i < limits.size(); ++i) {
    if (!limits[i].linear || (i == 0 && limits.size() > kArmAxes)) continue;
    throw ConfigError(fmt::format(
        "{}: axis {} of {} is linear: a linear unit is the first axis, before an arm of six", wire,
        i + 1, limits.size()));
  }
}

}  // namespace cellcal::drivers
