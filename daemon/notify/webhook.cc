#include "daemon/notify/webhook.h"

#include <fmt/format.h>

#include <exception>

#include "calib/files/calibration_json.h"
#include "daemon/files/printable.h"

namespace cellcal::daemon {

namespace {

constexpr int kTooManyRequests = 429, kRequestTimeout = 408;

std::string text_of(const WebhookUrl& url) {
  const bool v6 = url.host.find(':') != std::string::npos;
  return fmt::format("{}://{}:{}{}", url.tls ? "https" : "http",
                     v6 ? "[" + url.host + "]" : url.host, url.port, url.target);
}

Delivery judge(const Transfer::End& end) {
  if (end.code == CURLE_SSL_CACERT_BADFILE) return {false, false, end.why};
  if (end.code != CURLE_OK) return {false, true, end.why};
  if (end.status >= 200 && end.status < 300) return {true, false, ""};
  const bool again =
      end.status >= 500 || end.status == kTooManyRequests || end.status == kRequestTimeout;
  return {false, again, fmt::format("answered with status {}", end.status)};
}

}  // namespace

Delivery post(const WebhookConfig& config, const std::string& secret, const std::string& json) {
  try {
    Transfer transfer(text_of(config.url), config.ca, config.timeout_s);
    std::vector<std::string> headers{"Content-Type: application/json", "Connection: close",
                                     "Expect:"};
    if (!secret.empty()) headers.push_back("X-Cellcal-Secret: " + secret);
    const CurlList list = curl_list(headers);
    const std::string agent = std::string("cellcald/") + calib::software_version();
    transfer.set(CURLOPT_PROTOCOLS_STR, "http,https");
    transfer.set(CURLOPT_PATH_AS_IS, 1L);
    transfer.set(CURLOPT_HTTP_VERSION, static_cast<long>(CURL_HTTP_VERSION_1_1));
    transfer.set(CURLOPT_USERAGENT, agent.c_str());
    transfer.set(CURLOPT_HTTPHEADER, list.get());
    transfer.set(CURLOPT_POSTFIELDSIZE_LARGE, static_cast<::curl_off_t>(json.size()));
    transfer.set(CURLOPT_POSTFIELDS, json.c_str());
    return judge(transfer.run());
  } catch (const std::exception& error) {
    return {false, true, printable(error.what())};
  }
}

}  // namespace cellcal::daemon
