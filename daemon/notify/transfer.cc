#include "daemon/notify/transfer.h"

#include <fmt/format.h>

#include <new>
#include <stdexcept>

#include "calib/model/units.h"
#include "daemon/files/printable.h"

namespace cellcal::daemon {

namespace {

/// An answer is of no interest but for its status.
constexpr std::size_t kMostAnswer = 64u << 10;

/// libcurl ends the transfer where less is taken than it gave.
std::size_t leave_aside(char*, std::size_t, std::size_t bytes, void* taken) {
  auto& sum = *static_cast<std::size_t*>(taken);
  sum += bytes;
  return sum > kMostAnswer ? 0 : bytes;
}

}  // namespace

Transfer::Transfer(const std::string& url, const std::filesystem::path& ca, double timeout_s)
    : easy_(::curl_easy_init()), timeout_s_(timeout_s) {
  if (easy_ == nullptr) throw std::runtime_error("libcurl could not be set up");
  set(CURLOPT_ERRORBUFFER, words_);
  set(CURLOPT_URL, url.c_str());
  set(CURLOPT_NOSIGNAL, 1L);
  set(CURLOPT_PROXY, "");
  set(CURLOPT_TIMEOUT_MS, static_cast<long>(timeout_s * calib::kMsPerS));
  set(CURLOPT_CONNECTTIMEOUT_MS, static_cast<long>(timeout_s * calib::kMsPerS));
  set(CURLOPT_SSLVERSION, static_cast<long>(CURL_SSLVERSION_TLSv1_2));
  if (ca.empty()) return;
  set(CURLOPT_CAINFO, ca.c_str());
  // The system's folder of authorities would vouch beside it.
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

}  // namespace cellcal::daemon
