#pragma once
// One transfer by libcurl, which knows HTTP, SMTP and TLS: its options that are the same for all, and what came of it.
//
// TLS 1.2 and newer, the server's certificate verified against its name; nothing of the environment (proxies, .netrc) is
// asked; redirects are not followed. Waits on the thread that calls, for its time-out at the longest.

#include <curl/curl.h>

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "daemon/config/notify_config.h"

namespace cellcal::daemon {

struct Delivery {
  bool delivered = false;
  bool again = false;  ///< it may succeed later; also where it was delivered, to others
  std::string why;     ///< not delivered, or not to everybody; empty: delivered
  /// Who may take it later: the addresses to try again, and no others; empty: all.
  std::vector<std::string> left = {};
};

class Transfer {
 public:
  /// `ca`: PEM of who vouches for the server; empty: those whom the system trusts. Throws std::runtime_error: no memory.
  Transfer(const std::string& url, const std::filesystem::path& ca, double timeout_s);
  ~Transfer();
  Transfer(const Transfer&) = delete;
  Transfer& operator=(const Transfer&) = delete;

  /// As curl_easy_setopt. Throws std::runtime_error where this libcurl does not know the option.
  template <class Value>
  void set(::CURLoption option, Value value) {
    checked(::curl_easy_setopt(easy_, option, value));
  }

  /// Of a transfer as a whole, with the status that the server answered last (0: none).
  struct End {
    ::CURLcode code = CURLE_OK;
    int status = 0;
    std::string why;  ///< of a transfer that failed
  };
  End run();

 private:
  static void checked(::CURLcode code);

  ::CURL* easy_;
  double timeout_s_;
  char words_[CURL_ERROR_SIZE] = "";
};

/// A curl list that is freed with it.
using CurlList = std::unique_ptr<::curl_slist, decltype(&::curl_slist_free_all)>;
/// Throws std::bad_alloc.
CurlList curl_list(const std::vector<std::string>& lines);

/// The file's first line; empty where none is configured. Throws std::runtime_error: missing, empty, readable by
/// everybody, or no line that a header can hold.
std::string read_secret(const std::filesystem::path& file);

// One POST of JSON over HTTP or TLS.

/// `secret` is sent as X-Cellcal-Secret unless it is empty.
Delivery post(const WebhookConfig& config, const std::string& secret, const std::string& json);

}  // namespace cellcal::daemon
