#pragma once
// What is asked of the plant's database. Answers are JSON as the API gives it.

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
  std::vector<std::pair<std::string, std::int64_t>> needs;  ///< cells by what they need
};

/// One connection, made when it is first needed and again after it broke. One thread. All throw StoreUnavailable.
class Reading {
 public:
  explicit Reading(std::string connection);
  ~Reading();
  Reading(const Reading&) = delete;
  Reading& operator=(const Reading&) = delete;

  /// {"cells": [...]}: those that need attention first, worst first, each with why.
  std::string cells();
  /// One cell with its calibrations, checks, sessions, gaps, what was refused. None: there is no such cell.
  std::optional<std::string> cell(const plant::CellName& name);
  /// One joint's corrections over the robots of a model.
  std::string compare(const std::string& robot, const std::string& joint);
  std::string overdue();
  /// The document of the newest calibration of that journal and session, byte for byte.
  std::optional<StoredFile> calibration(const plant::CellName& name, const std::string& journal,
                                        std::int64_t session);
  std::optional<StoredFile> check(const plant::CellName& name, const std::string& journal,
                                  std::int64_t session);
  /// Of the newest certificate of that session; empty: there is none.
  std::vector<StoredFile> certificate(const plant::CellName& name, const std::string& journal,
                                      std::int64_t session);
  Totals totals();

  struct Impl;

 private:
  std::unique_ptr<Impl> impl_;
};

}  // namespace cellcal::daemon::fleet
