#pragma once
// The sections of the report, in the order of the page. Each returns HTML and computes nothing that
// the calibration does not already say.

#include <string>
#include <string_view>

#include "daemon/report/view.h"

namespace cellcal::daemon::report {

std::string verdict_banner(const View& view);
std::string summary(const View& view);
std::string figures_table(const View& view);
std::string meaning(const View& view);
std::string residual_chart(const View& view);
std::string residual_histogram(const View& view);
std::string cell_picture(const View& view);
std::string plan(const View& view);
std::string sphere_maps(const View& view);
std::string targets_table(const View& view);
std::string model(const View& view);
std::string parameters_table(const View& view);
std::string unidentifiable(const View& view);
std::string outliers(const View& view);
std::string correlations(const View& view);
std::string traceability(const View& view);
std::string raw_touches(const View& view);

/// What was fitted and how, in words, escaped; empty where the method knows no levels.
std::string level_words(const View& view);
std::string method_words(std::string_view method);

/// The style sheet, without the <style> tags.
const char* style_sheet();

}  // namespace cellcal::daemon::report
