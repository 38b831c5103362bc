#pragma once
// Whether an answer is as daemon/api/openapi.json describes it. Knows the keywords that stand there, and
// no others: one that it does not know is an error.

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace cellcal::daemon::testing {

class Description {
 public:
  /// Throws where the file is no JSON.
  explicit Description(const std::string& file);

  const nlohmann::json& document() const { return document_; }
  /// What is wrong with the value, line by line; empty: nothing.
  std::string complaint(const nlohmann::json& value, const nlohmann::json& schema) const;
  std::string complaint(const nlohmann::json& value, const std::string& schema_name) const;

 private:
  void check(const nlohmann::json& value, const nlohmann::json& schema, const std::string& at,
             std::string& words) const;

  nlohmann::json document_;
};

}  // namespace cellcal::daemon::testing
