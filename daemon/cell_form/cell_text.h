#pragma once
// Cell file written by new-cell: every key of cellcal.cell/1, set or as a comment.
//
// `#key = value` shows a default and has the same effect without the '#'. Keys of another kind of target or
// obstacle are given in whole commented tables, keys that exclude a set one in the text.

#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "daemon/cell_form/cell_form.h"

namespace cellcal::daemon {

std::string cell_text(const CellForm& form);

/// xyz_mm, abc_deg and, where stated, mass_kg and com_mm: keys of [tool] and their values.
std::vector<std::pair<std::string, std::string>> tool_keys(const ToolForm& tool);
/// A cell file's text with these keys of [tool] set and all else as it is, byte by byte. Throws calib::FileError
/// naming the line where they are not `key = value` on a line of its own below [tool].
std::string with_tool(const std::string& text, const std::string& name, const ToolForm& tool);

// Content of a cell file beyond the form: listed, and kept in the file that the form writes.

/// Its names, e.g. "tool.com_mm", "target plate"; empty: fully represented by the form. `text`: a cell file
/// that form_in() reads as `form`.
std::vector<std::string> beyond(const CellForm& form, const std::string& text);

/// The form's file including the content of `before` beyond its form; with explanatory comments where there
/// is none. Throws calib::FileError.
std::string cell_text_with(const CellForm& form, const std::string& before);

// Spheres and their certificate from CSV files or Digital Calibration Certificates (XML). All functions throw calib::FileError with file, line and
// column.

/// `name`: of the text, for error messages.
std::vector<SphereForm> spheres_in(std::string_view csv, const std::string& name);
std::vector<LengthForm> certificate_in(std::string_view csv, const std::string& name);
std::vector<SphereForm> load_spheres(const std::filesystem::path& csv);
std::vector<LengthForm> load_certificate(const std::filesystem::path& csv);

// Diameters of spheres and lengths between them out of a Digital Calibration Certificate (PTB's DCC 2.x and 3.x with
// D-SI 1.x and 2.x). It is read as data alone: no schema, style sheet or entity is fetched or expanded, and its
// signature is not verified.

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
