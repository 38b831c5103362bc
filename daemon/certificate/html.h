#pragma once
// Entries and the pose sheet in the certificate's HTML.

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/certificate/sources.h"

namespace cellcal::daemon::certificate {

/// The entry with its origin, numbers with the document's decimal mark; `otherwise`, an id of the catalogue or a sign,
/// where it is not stated.
std::string shown(const Entry& entry, const char* otherwise = "say.report.not_stated");
/// The number followed by its unit.
std::string with_unit(const Entry& entry, const char* otherwise = "\xE2\x80\x93");
/// The unit only, as "unit(origin)".
std::string unit(const Entry& entry);
/// A constant of the method (README, Origins).
std::string constant(const char* name);
/// Printed value of the constant.
std::string_view value_of_constant(std::string_view name);

/// The style sheet, without the <style> tags.
const char* style_sheet();

// Pose accuracy and repeatability in the terms of ISO 9283, where the session has touches for it.

/// Held-out touches of one artefact.
struct PoseAccuracyRow {
  Entry target, poses, mean, largest, predicted;
};
/// Touches repeated at one place; `first` is the number of the first of them.
struct PoseRepeatabilityRow {
  Entry target, first, repeats, mean, sigma, rp, predicted;
};
struct PoseSheetData {
  std::vector<PoseAccuracyRow> accuracy;
  std::vector<PoseRepeatabilityRow> repeatability;
  bool empty() const { return accuracy.empty() && repeatability.empty(); }
};

PoseSheetData pose_sheet_of(const Sources& sources, const std::vector<bool>& outlier);
/// A section; empty without touches for it.
std::string pose_sheet_html(const PoseSheetData& sheet);
/// null without.
nlohmann::ordered_json pose_sheet_json(const PoseSheetData& sheet);

}  // namespace cellcal::daemon::certificate
