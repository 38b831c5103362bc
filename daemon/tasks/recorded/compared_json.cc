#include "daemon/tasks/recorded/compared_json.h"

#include <nlohmann/json.hpp>
#include <stdexcept>

namespace cellcal::daemon {

std::string compared_to_json(const Compared& compared) {
  return nlohmann::json{{"words", compared.words},
                        {"accepted", compared.accepted},
                        {"calibration", compared.calibration}}
             .dump() +
         "\n";
}

Compared compared_from_json(const std::string& text) {
  try {
    const nlohmann::json json = nlohmann::json::parse(text);
    return {json.at("words"), json.at("accepted"), json.at("calibration")};
  } catch (const nlohmann::json::exception&) {
    throw std::runtime_error(
        "compared.json: damaged: words, accepted and calibration are needed. Export the session again");
  }
}

}  // namespace cellcal::daemon
