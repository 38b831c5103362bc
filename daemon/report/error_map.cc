// Predicted error over the arm's reach, before and after, as one picture on one scale.

#include "calib/check/error_map.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "calib/model/units.h"
#include "daemon/report/axes.h"
#include "daemon/report/report.h"

namespace cellcal::daemon::report {
namespace {

using svg::Anchor, svg::Paint, svg::Point, svg::Svg;

constexpr double kMapWidth = 940.0, kMapLeft = 46.0, kMapTop = 30.0, kMapPanel = 400.0,
                 kMapGap = 50.0, kMapMost = 420.0;
constexpr double kKeyHeight = 12.0, kKeyWidth = 560.0;
constexpr int kKeySteps = 112;

using Rgb = std::array<double, 3>;
/// Light to dark, distinguishable with colour vision deficiency and in grey.
constexpr std::array<Rgb, 6> kColours{{{252, 253, 217},
                                       {184, 224, 180},
                                       {65, 176, 196},
                                       {29, 135, 189},
                                       {35, 86, 165},
                                       {11, 20, 64}}};

/// Errors to colours: a factor has the same step anywhere, since before and after differ by a factor of ten.
class ColourScale {
 public:
  explicit ColourScale(const calib::ErrorMap& map) {
    for (const calib::ErrorCell& cell : map.cells)
      for (const double metres : {cell.nominal_m, cell.calibrated_m}) {
        const double mm = std::max(metres * calib::kMmPerM, kLeastMm);
        low_ = std::min(low_, std::log10(mm));
        high_ = std::max(high_, std::log10(mm));
      }
    const double spare = std::max(0.0, kLeastDecades - (high_ - low_)) / 2.0;
    low_ -= spare;
    high_ += spare;
  }

  std::string colour(double mm) const {
    return at((std::log10(std::max(mm, kLeastMm)) - low_) / (high_ - low_));
  }
  /// From the lightest (0) to the darkest (1).
  static std::string at(double share) {
    const double place = std::clamp(share, 0.0, 1.0) * static_cast<double>(kColours.size() - 1);
    const auto lower = std::min(static_cast<std::size_t>(place), kColours.size() - 2);
    std::array<int, 3> mixed{};
    for (std::size_t i = 0; i < mixed.size(); ++i)
      mixed[i] = static_cast<int>(std::lround(std::lerp(kColours[lower][i], kColours[lower + 1][i],
                                                        place - static_cast<double>(lower))));
    return fmt::format("#{:02x}{:02x}{:02x}", mixed[0], mixed[1], mixed[2]);
  }
  /// Round values in the range, and where they are in it (0 to 1).
  std::vector<std::pair<double, double>> ticks() const {
    std::vector<std::pair<double, double>> found;
    for (int decade = static_cast<int>(std::floor(low_)); decade <= high_; ++decade)
      for (const double digit : {1.0, 2.0, 5.0}) {
        const double value = digit * std::pow(10.0, decade),
                     share = (std::log10(value) - low_) / (high_ - low_);
        if (share >= 0.0 && share <= 1.0) found.emplace_back(value, share);
      }
    return found;
  }

 private:
  static constexpr double kLeastMm = 1e-4, kLeastDecades = 0.5;
  double low_ = 10.0, high_ = -10.0;  ///< logarithms of mm
};

/// The slice in pixels.
struct SlicePanel {
  Scale across, up;
  double square = 0.0;
};

SlicePanel panel_of(const calib::ErrorMap& map, double left) {
  double low = 0.0, high = 0.0, far = 0.0;
  for (const calib::ErrorCell& cell : map.cells) {
    low = std::min(low, cell.z_m - map.step_m / 2.0);
    high = std::max(high, cell.z_m + map.step_m / 2.0);
    far = std::max(far, cell.r_m + map.step_m / 2.0);
  }
  const double pixels = std::min(kMapPanel / far, kMapMost / (high - low));
  return {{0.0, far * calib::kMmPerM, left, left + far * pixels},
          {low * calib::kMmPerM, high * calib::kMmPerM, kMapTop + (high - low) * pixels, kMapTop},
          map.step_m * pixels};
}

void draw_axes(Svg& svg, const SlicePanel& panel) {
  constexpr int kTicks = 6;
  for (const double tick : round_ticks(panel.up.from, panel.up.to, kTicks))
    svg.text({panel.across.at_from - 6.0, panel.up(tick) + 4.0}, Anchor::kEnd, "tick",
             fixed(tick, 0));
  for (const double tick : round_ticks(panel.across.from, panel.across.to, kTicks))
    svg.text({panel.across(tick), panel.up.at_from + 16.0}, Anchor::kMiddle, "tick",
             fixed(tick, 0));
  svg.line({panel.across.at_from, panel.up.at_to}, {panel.across.at_from, panel.up.at_from},
           "axis");
  svg.line({panel.across.at_from, panel.up(0.0)}, {panel.across.at_to, panel.up(0.0)}, "zero");
}

void draw_slice(Svg& svg, const View& view, const calib::ErrorMap& map, const SlicePanel& panel,
                const ColourScale& colours, std::string_view heading,
                double calib::ErrorCell::*of) {
  svg.text({panel.across.at_from, kMapTop - 12.0}, Anchor::kStart, "panel", heading);
  for (const calib::ErrorCell& cell : map.cells) {
    const std::string fill = colours.colour(cell.*of * calib::kMmPerM);
    svg.rectangle({panel.across((cell.r_m - map.step_m / 2.0) * calib::kMmPerM),
                   panel.up((cell.z_m + map.step_m / 2.0) * calib::kMmPerM)},
                  panel.square + 0.4, panel.square + 0.4, Paint{.fill = fill});
  }
  draw_axes(svg, panel);
  Labels labels(panel.across.at_from, panel.up.at_to, panel.across.at_to);
  const Eigen::Isometry3d to_foot = view.result.cell.robot.base_fixed.inverse();
  for (const calib::TargetResult& target : view.result.targets) {
    if (!target.centre_m.allFinite()) continue;
    const Eigen::Vector3d at = to_foot * place_in_base(view, target) * calib::kMmPerM;
    const double r = at.head<2>().norm();
    if (!panel.across.holds(r) || !panel.up.holds(at.z())) continue;
    const Point where{panel.across(r), panel.up(at.z())};
    const std::string name = shorten(target.id, 12);
    svg.circle(where, 5.0, Paint{.fill = "#ffffff", .stroke = "#b84300", .stroke_width = 2.0});
    svg.text(labels.beside(where, 5.0, name.size()), Anchor::kStart, "label", name);
  }
}

void draw_key(Svg& svg, const View& view, const ColourScale& colours, double top) {
  constexpr double kStep = kKeyWidth / kKeySteps;
  for (int i = 0; i < kKeySteps; ++i) {
    const std::string fill = ColourScale::at((i + 0.5) / kKeySteps);
    svg.rectangle({kMapLeft + i * kStep, top}, kStep + 0.4, kKeyHeight, Paint{.fill = fill});
  }
  for (const auto& [value, share] : colours.ticks())
    svg.text({kMapLeft + share * kKeyWidth, top + kKeyHeight + 14.0}, Anchor::kMiddle, "tick",
             significant(value, 6));
  svg.text({kMapLeft + kKeyWidth + 10.0, top + 11.0}, Anchor::kStart, "tick",
           view.say("say.report.error_map.key"));
}

/// Finite, and near any arm.
constexpr double kFarM = 100.0;
bool can_be_drawn(const calib::ErrorCell& cell) {
  return std::abs(cell.z_m) < kFarM && cell.r_m >= 0.0 && cell.r_m < kFarM &&
         is_usable_mm(cell.nominal_m * calib::kMmPerM) &&
         is_usable_mm(cell.calibrated_m * calib::kMmPerM);
}

}  // namespace

std::string error_map_plot(const View& view) {
  auto map = view.input.error_map;
  if (map)
    std::erase_if(map->cells, [](const calib::ErrorCell& cell) { return !can_be_drawn(cell); });
  if (!map || map->cells.empty() || !(map->step_m > 0.0 && map->step_m < kFarM)) return "";
  const SlicePanel before = panel_of(*map, kMapLeft),
                   after = panel_of(*map, kMapLeft + kMapPanel + kMapGap);
  const ColourScale colours(*map);
  const double key_top = before.up.at_from + 40.0;
  Svg svg(kMapWidth, key_top + kKeyHeight + 24.0, "chart error-map",
          view.say("say.report.error_map.picture"));
  draw_slice(svg, view, *map, before, colours, view.say("say.report.error_map.before"),
             &calib::ErrorCell::nominal_m);
  draw_slice(svg, view, *map, after, colours, view.say("say.report.error_map.after"),
             &calib::ErrorCell::calibrated_m);
  draw_key(svg, view, colours, key_top);
  return std::move(svg).finish();
}

std::string error_map(const View& view) {
  const std::string plot = error_map_plot(view);
  if (plot.empty()) return "";
  return section(
      "error-map", "say.report.error_map",
      fmt::format("<div class=\"scroll\">{}</div>\n", plot) +
          paragraph("note", say(view.result.verdict.workspace ? "say.report.error_map.note"
                                                              : "say.report.error_map.note.near")));
}

}  // namespace cellcal::daemon::report
