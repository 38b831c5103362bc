#pragma once
// Pose accuracy and repeatability in the terms of ISO 9283, where the session has touches for it.

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "daemon/certificate/sources.h"

namespace cellcal::daemon::certificate {

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
