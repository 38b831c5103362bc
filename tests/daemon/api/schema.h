#pragma once
// Validation of answers against daemon/api/openapi.json. Supports the keywords used there only; an
// unknown keyword is an error.

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace cellcal::daemon::testing {

class Description {
 public:
  /// Throws if the file is not JSON.
  explicit Description(const std::string& file);

  const nlohmann::json& document() const { return document_; }
  /// Errors of the value, one per line; empty: valid.
  std::string complaint(const nlohmann::json& value, const nlohmann::json& schema) const;
  std::string complaint(const nlohmann::json& value, const std::string& schema_name) const;

 private:
  void check(const nlohmann::json& value, const nlohmann::json& schema, const std::string& at,
             std::string& words) const;

  nlohmann::json document_;
};

}  // namespace cellcal::daemon::testing
