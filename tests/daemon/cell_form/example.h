#pragma once
// A form as sent by the page.

#include <nlohmann/json.hpp>

namespace cellcal::daemon::testing {

inline nlohmann::json example() {
  return nlohmann::json::parse(R"({
    "robot": "kr5_r1400",
    "tool": {"xyz_mm": [59.9, 50.5, 410.3], "abc_deg": [38.84, 3.59, 0], "mass_kg": 1.5, "tip_radius_mm": 0},
    "spheres": [
      {"id": "S1", "diameter_mm": 50, "diameter_sigma_mm": 0.001, "centre_mm": [900, -300, 400],
       "centre_sigma_mm": 5, "serial": "77", "certificate": "DKD-1", "certificate_date": "2026-04-01"},
      {"id": "S2", "diameter_mm": 50, "centre_mm": [900, 300, 400]},
      {"id": "S3", "diameter_mm": 50, "box_mm": [[1000, -50, 350], [1100, 50, 450]]}],
    "lengths": [{"from": "S1", "to": "S2", "mm": 600.012, "sigma_mm": 0.004, "certificate": "DKD-1"}]})");
}

}  // namespace cellcal::daemon::testing
