#pragma once
// A refused value of a file whose place in the document is known.

#include <string>
#include <utility>

#include "calib/model/error.h"

namespace cellcal::calib {

struct KeyError : FileError {
  /// The message is `file` + `place` + `path_in_file` + ": " + `what_is_wrong`; place ":12: ".
  KeyError(const std::string& file, const std::string& place, std::string path_in_file,
           std::string what_is_wrong)
      : FileError(file, place + path_in_file + ": " + what_is_wrong),
        path(std::move(path_in_file)),
        reason(std::move(what_is_wrong)) {}

  std::string path;    ///< TOML, counted from 1: "target[2].diameter_mm"; JSON, from 0: ".spheres[1].mm"
  std::string reason;  ///< without the place
};

}  // namespace cellcal::calib
