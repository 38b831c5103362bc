#pragma once
// What a cell file may say of who and what was there: serial numbers, certificates, names. A certificate prints
// it from the file's text; nothing is computed of it, so that it is no part of a Cell.

#include "calib/syntax/toml_table.h"

namespace cellcal::calib {

/// [identity]: `site`, `operator`, `robot_serial`, `controller_serial`, `sensor`, `sensor_serial`. Throws FileError.
void check_identity(const TomlTable& document);
/// Of a [[target]] `serial`, and of this and a [[length]] `certificate` (its number and who issued it) and
/// `certificate_date` ("2026-04-01"). Throws FileError.
void check_certificate(const TomlTable& artefact);
void check_artefact(const TomlTable& target);

}  // namespace cellcal::calib
