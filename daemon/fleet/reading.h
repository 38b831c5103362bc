#pragma once
// Queries of the plant's database. Answers are JSON as in the API.

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "daemon/fleet/store.h"
#include "daemon/plant/messages/text_fields.h"

namespace cellcal::daemon::fleet {

struct StoredFile {
  std::string name;
  std::string bytes, sha256;  ///< as the cell sent them
};

struct Totals {
  std::int64_t cells = 0, online = 0, gaps = 0, refused = 0;
  std::vector<std::pair<std::string, std::int64_t>> needs;  ///< number of cells by need
};

/// One connection, opened on first use and again after a failure. For use by one thread. All
/// members throw StoreUnavailable.
class Reading {
 public:
  explicit Reading(std::string connection);
  ~Reading();
  Reading(const Reading&) = delete;
  Reading& operator=(const Reading&) = delete;

  /// {"cells": [...]}: those that need attention first, worst first, each with the reason.
  std::string cells();
  /// One cell with its calibrations, checks, sessions, gaps and refusals; nullopt if unknown.
  std::optional<std::string> cell(const plant::CellName& name);
  /// Corrections of one joint over the robots of a model.
  std::string compare(const std::string& robot, const std::string& joint);
  std::string overdue();
  /// Document of the newest calibration of that journal and session, byte for byte.
  std::optional<StoredFile> calibration(const plant::CellName& name, const std::string& journal,
                                        std::int64_t session);
  std::optional<StoredFile> check(const plant::CellName& name, const std::string& journal,
                                  std::int64_t session);
  /// Files of the newest certificate of that session; empty if there is none.
  std::vector<StoredFile> certificate(const plant::CellName& name, const std::string& journal,
                                      std::int64_t session);
  Totals totals();

  struct Impl;

 private:
  std::unique_ptr<Impl> impl_;
};

}  // namespace cellcal::daemon::fleet
