#pragma once
// Classifies messages.

#include <chrono>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "daemon/fleet/store.h"
#include "daemon/plant/messages/text_fields.h"

namespace cellcal::daemon::fleet {

// Rate limit of each cell: token buckets of messages and bytes.

struct Allowance {
  double messages_per_s = 20.0;
  double burst = 50'000.0;  ///< messages; a week offline with one health fact a minute has 10 080
  double bytes_per_day = 1.0e9;  ///< also the largest burst
};

/// For use by one thread.
class Meters {
 public:
  using Time = std::chrono::steady_clock::time_point;

  explicit Meters(Allowance allowance) : allowance_(allowance) {}
  /// False if the cell's allowance is used up. Messages without a cell share one allowance.
  bool allows(const plant::CellName& cell, std::size_t bytes, Time now);

 private:
  struct Meter {
    double messages = 0.0, bytes = 0.0;  ///< left
    Time at;
  };
  Meter& meter_of(const plant::CellName& cell, Time now);

  Allowance allowance_;
  std::map<plant::CellName, Meter> meters_;
};

struct Message {
  std::string topic, payload;
};

/// Adds the message to the batch. Throws only std::bad_alloc.
void judge(Message message, Meters& meters, Meters::Time now, Batch& batch);

/// True for a time such as "2026-11-22T20:51:17.123Z", with a valid date in the years 1970 to 9999.
bool is_time(std::string_view text);

// Queries of the plant's database. Answers are JSON as the API gives it.

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
