#include "daemon/unattended/transfer.h"

#include <fmt/format.h>
#include <sys/stat.h>

#include <algorithm>
#include <exception>
#include <fstream>
#include <new>
#include <stdexcept>

#include "calib/files/calibration_json.h"
#include "calib/model/units.h"
#include "daemon/files/atomic_file.h"

namespace cellcal::daemon {

namespace {

/// Only the status of an answer is used.
constexpr std::size_t kMostAnswer = 64u << 10;

/// libcurl aborts the transfer where fewer bytes are taken than offered.
std::size_t leave_aside(char*, std::size_t, std::size_t bytes, void* taken) {
  auto& sum = *static_cast<std::size_t*>(taken);
  sum += bytes;
  return sum > kMostAnswer ? 0 : bytes;
}

}  // namespace

Transfer::Transfer(const std::string& url, const std::filesystem::path& ca, double timeout_s)
    : easy_(::curl_easy_init()), timeout_s_(timeout_s) {
  if (easy_ == nullptr) throw std::runtime_error("libcurl could not be initialised");
  set(CURLOPT_ERRORBUFFER, words_);
  set(CURLOPT_URL, url.c_str());
  set(CURLOPT_NOSIGNAL, 1L);
  set(CURLOPT_PROXY, "");
  set(CURLOPT_TIMEOUT_MS, static_cast<long>(timeout_s * calib::kMsPerS));
  set(CURLOPT_CONNECTTIMEOUT_MS, static_cast<long>(timeout_s * calib::kMsPerS));
  set(CURLOPT_SSLVERSION, static_cast<long>(CURL_SSLVERSION_TLSv1_2));
  if (ca.empty()) return;
  set(CURLOPT_CAINFO, ca.c_str());
  // The system's folder of authorities would be trusted in addition.
  set(CURLOPT_CAPATH, static_cast<char*>(nullptr));
}

Transfer::~Transfer() { ::curl_easy_cleanup(easy_); }

void Transfer::checked(::CURLcode code) {
  if (code != CURLE_OK)
    throw std::runtime_error(std::string("libcurl: ") + ::curl_easy_strerror(code));
}

Transfer::End Transfer::run() {
  std::size_t taken = 0;
  set(CURLOPT_WRITEFUNCTION, &leave_aside);
  set(CURLOPT_WRITEDATA, &taken);
  End end;
  end.code = ::curl_easy_perform(easy_);
  long status = 0;
  ::curl_easy_getinfo(easy_, CURLINFO_RESPONSE_CODE, &status);
  end.status = static_cast<int>(status);
  if (end.code == CURLE_OK) return end;
  const std::string words = printable(words_[0] != '\0' ? words_ : ::curl_easy_strerror(end.code));
  switch (end.code) {
    case CURLE_OPERATION_TIMEDOUT:
      end.why = fmt::format("no answer within {:g} s", timeout_s_);
      break;
    case CURLE_COULDNT_RESOLVE_HOST:
      end.why = "its name cannot be resolved: " + words;
      break;
    case CURLE_COULDNT_CONNECT:
      end.why = "cannot connect: " + words;
      break;
    case CURLE_SSL_CONNECT_ERROR:
    case CURLE_PEER_FAILED_VERIFICATION:
    case CURLE_SSL_CACERT_BADFILE:
    case CURLE_USE_SSL_FAILED:
      end.why = "TLS: " + words;
      break;
    default:
      end.why = words;
  }
  return end;
}

CurlList curl_list(const std::vector<std::string>& lines) {
  CurlList list(nullptr, &::curl_slist_free_all);
  for (const std::string& line : lines) {
    ::curl_slist* longer = ::curl_slist_append(list.get(), line.c_str());
    if (longer == nullptr) throw std::bad_alloc();
    list.release();
    list.reset(longer);
  }
  return list;
}

std::string read_secret(const std::filesystem::path& file) {
  if (file.empty()) return "";
  struct ::stat status {};
  if (::stat(file.c_str(), &status) != 0)
    throw std::runtime_error(file.string() + ": missing or unreadable");
  if ((status.st_mode & S_IROTH) != 0)
    throw std::runtime_error(file.string() + ": readable by every user. Restrict it: chmod o-r " +
                             file.string());
  std::ifstream in(file);
  std::string line;
  std::getline(in, line);
  const bool sound =
      !line.empty() && line.size() <= 1000 &&
      std::all_of(line.begin(), line.end(), [](char c) { return '!' <= c && c <= '~'; });
  if (!sound)
    throw std::runtime_error(file.string() +
                             ": its first line must be 1 to 1000 visible ASCII characters");
  return line;
}

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
