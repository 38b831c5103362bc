#pragma once
// Diameters of spheres and lengths between them out of a Digital Calibration Certificate (PTB's DCC 2.x and 3.x with
// D-SI 1.x and 2.x). It is read as data alone: no schema, style sheet or entity is fetched or expanded, and its
// signature is not verified.

#include <string>
#include <string_view>
#include <vector>

#include "daemon/cell_form/cell_form.h"

namespace cellcal::daemon {

/// With scans and PDF files embedded.
inline constexpr std::size_t kMostCertificateBytes = 16u << 20;
/// True for text that is XML rather than a table.
bool is_xml(std::string_view text);

/// All functions throw calib::FileError with file, line and what to do.
///
/// One quantity of a sphere's diameter each, with its expanded uncertainty over k as sigma. `id`: the target that the
/// quantity, its list or its item names ("S1"); otherwise the serial number. The centre is not stated.
std::vector<SphereForm> spheres_in_dcc(std::string_view xml, const std::string& name);
/// Distances of two centres: quantities that name both spheres ("S1-S2", "distance S1 to S2").
std::vector<LengthForm> lengths_in_dcc(std::string_view xml, const std::string& name);

}  // namespace cellcal::daemon
