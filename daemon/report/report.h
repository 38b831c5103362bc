#pragma once
// Calibration report: one self-contained HTML file for those who rely on, use or reject a calibration. No
// script and no external resource, so that it remains readable for years.

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "calib/check/error_map.h"
#include "calib/export/svg.h"
#include "calib/model/touch.h"
#include "calib/plan/plan.h"
#include "calib/result/calibration.h"
#include "calib/result/drift_chart.h"
#include "calib/words/phrase.h"
#include "daemon/report/say.h"

namespace cellcal::daemon {

/// Content of the report. All strings are UTF-8, may come from users' files, and are escaped. Empty strings
/// and sets are omitted or reported as missing, never an error.
struct ReportInput {
  calib::Calibration calibration;
  /// As measured, in order; Calibration::residuals and ::outliers index into it.
  std::vector<calib::Touch> touches;
  std::string session_id;
  std::string started;   ///< ISO 8601
  std::string finished;  ///< ISO 8601
  std::string cell_name;
  std::string software;                      ///< e.g. calib::software_version()
  std::vector<calib::Phrase> notes;          ///< remarks on the conditions
  std::optional<calib::Plan> plan;           ///< where the touches were planned
  double planned_s = 0.0;                    ///< predicted robot time [s]; 0: unknown
  std::optional<calib::ErrorMap> error_map;  ///< of the calibration
  /// Checks of the cell's calibrations before this one, and its changes up to this one; none: not known.
  std::optional<calib::DriftChart> checks;
  calib::Language language;
  /// Simulated cells only: name and deviation from the hidden truth, labelled as such.
  std::vector<std::pair<std::string, std::string>> truth;
};

/// "report.html"; "report.de.html" in another language than English.
std::string report_name(const calib::Language& language);
/// "plots.json", likewise.
std::string plots_name(const calib::Language& language);

/// The complete document, UTF-8. Never throws for invalid input: a non-finite number is shown as a dash and
/// counted in the text.
std::string html_report(const ReportInput& input);

/// Plots of the report as inline SVG, coloured by classes of a style sheet; empty without anything to draw.
struct ReportPlots {
  std::string before_after;           ///< residual of every touch
  std::vector<std::string> by_joint;  ///< residual by joint angle
  std::string error_map;
};
ReportPlots report_plots(const ReportInput& input);
/// As JSON, with the session's number, for the page.
std::string plots_json(std::int64_t session, const ReportPlots& plots);

}  // namespace cellcal::daemon

namespace cellcal::daemon::report {

// Shared data of all sections: each touch with its kind, target and residuals in millimetres.

enum class MarkKind { kFit, kCheck, kOutlier };

/// Larger or non-finite values are not measurements, and would distort every scale.
inline constexpr double kUsableMm = 1e6;
bool is_usable_mm(double value);

/// A predicted error of zero means that it was not predicted.
bool is_known(double predicted_m);

/// One residual as drawn.
struct Mark {
  std::size_t number = 0;  ///< of the touch, from 1, as displayed
  MarkKind kind = MarkKind::kFit;
  bool held_out = false;  ///< a check touch, outlier or not
  std::string target;     ///< empty where the touch is unknown
  double before_mm = 0.0, after_mm = 0.0;
  double whitened = 0.0;
  bool in_3d = false;  ///< on a point or by a tracker: residuals are non-negative distances
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();  ///< base frame; zero: none
};

/// References the input, which must outlive this.
struct View {
  explicit View(const ReportInput& report_input);

  const ReportInput& input;
  Speaking speaking;  ///< the input's language
  const calib::Calibration& result;
  std::vector<Mark> marks;  ///< usable ones only, in the order of the residuals
  std::size_t fit = 0, check = 0, outliers = 0;  ///< touches by kind
  std::size_t unusable = 0;  ///< residuals omitted from every drawing: not finite or too large
  std::size_t unknown = 0;   ///< residuals of unknown touches

  /// nullptr where the cell has no such target.
  const calib::Target* cell_target(std::string_view id) const;
  const calib::TargetResult* target_result(std::string_view id) const;
  bool is_point(std::string_view id) const;  ///< or a tracker: measured in all three directions
  /// Touched from several directions: a sphere or a wire.
  bool is_round(std::string_view id) const;
  bool points_only() const;  ///< all marks, at least one, are on points
  bool any_point() const;
  /// Certified lengths that hold the scale, by the verdict; where it counts none, those with both ends touched.
  std::size_t touched_lengths() const;
  /// Not escaped.
  std::string say(const calib::Phrase& phrase) const { return report::say(phrase); }
};

/// As in tables: "A2.theta".
std::string name_of(const View& view, const calib::ParameterResult& parameter);

std::string kind_word(calib::TargetKind kind);
/// "4 spheres", "2 points"; "3 targets" for mixed kinds. In German in the dative: "an 4 Kugeln".
std::string target_words(const View& view);
/// "touch 12 on S1, held out: 2.310 mm before, 0.021 mm after".
std::string mark_title(const View& view, const Mark& mark);
/// Fitted ones are circles of radius `size`, others diamonds and crosses of `larger`, of classes of kind and `look`.
void draw_shape(svg::Svg& svg, MarkKind kind, svg::Point at, double size, double larger,
                std::string_view look, std::string_view title);
void draw_mark(svg::Svg& svg, const View& view, const Mark& mark, svg::Point at, double size,
               double larger, std::string_view look);

/// "<section ...><h2>" heading, an id of the catalogue, "</h2>" ... "</section>" around the body.
std::string section(std::string_view id, const char* heading, std::string_view body);

// Sections of the report, in page order. Each returns HTML and computes nothing beyond the calibration's own
// values.

std::string verdict_banner(const View& view);
std::string summary(const View& view);
std::string figures_table(const View& view);
std::string meaning(const View& view);
std::string residual_chart(const View& view);
std::string joint_residuals(const View& view);  ///< empty without any to draw
std::string residual_histogram(const View& view);
std::string error_map(const View& view);    ///< empty without a map
std::string check_chart(const View& view);  ///< empty without checks and changes
std::string cell_picture(const View& view);
std::string plan(const View& view);
std::string sphere_maps(const View& view);
std::string targets_table(const View& view);
std::string model(const View& view);
std::string parameters_table(const View& view);
/// Axes of a positioner as found; empty without one.
std::string positioner_table(const View& view);
/// A linear unit as found; empty without one.
std::string linear_unit_table(const View& view);
/// In the base frame [m]; of a target on a positioner with all its axes at 0.
Eigen::Vector3d place_in_base(const View& view, const calib::TargetResult& target);
std::string unidentifiable(const View& view);
std::string outliers(const View& view);
std::string correlations(const View& view);
std::string traceability(const View& view);
std::string raw_touches(const View& view);

/// Selected model and method, escaped; empty for methods without levels.
std::string level_words(const View& view);
std::string method_words(std::string_view method);

// Plots without their sections.

std::string residual_plot(const View& view);
std::vector<std::string> joint_plots(const View& view);
std::string error_map_plot(const View& view);

/// style.css, compiled in by the build.
extern const std::string_view kStyleSheet;

}  // namespace cellcal::daemon::report
