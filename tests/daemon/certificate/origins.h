#pragma once
// Values of the certificate recomputed from their origins, using the rows of an export only: the printed
// values must be equal.

#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <variant>
#include <vector>

#include "calib/result/calibration.h"
#include "daemon/archive/archive.h"
#include "daemon/certificate/certificate.h"

namespace cellcal::daemon::testing {

/// Issuer data of all certificates in these tests.
inline const certificate::Issue kIssue{"2026-04-02T08:00:00.000Z", "Q. Auditor 1", "9.9.9"};

/// Figure by the id of its wording, "as_found" and "as_left"; null without.
nlohmann::ordered_json figure_of(const certificate::CertificateData& data, const std::string& id);

class Origins {
 public:
  explicit Origins(const Archive& archive);

  /// A number in its unit, or a text. Throws std::runtime_error for an invalid origin.
  std::variant<double, std::string> at(const std::string& from) const;

 private:
  std::variant<double, std::string> touch(const std::string& path) const;
  std::variant<double, std::string> over_touches(const std::string& name) const;
  double found(const std::string& path) const;
  double scope(const std::string& name) const;
  std::variant<double, std::string> poses(const std::string& path) const;
  std::string unit(const std::string& from) const;

  std::string rows_;
  nlohmann::json session_, calibration_, compared_, cell_, robot_;
  std::string compared_words_;
  std::vector<nlohmann::json> touches_;
  std::map<std::int64_t, nlohmann::json> changes_;
};

}  // namespace cellcal::daemon::testing
