#pragma once
// One transfer by libcurl (HTTP, SMTP, TLS): common options and the result.
//
// TLS 1.2 or newer, with the server's certificate verified against its name; the environment (proxies,
// .netrc) is ignored; redirects are not followed. Blocks the calling thread, at most for its time-out.

#include <curl/curl.h>

#include <chrono>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "daemon/config/unattended_config.h"
#include "daemon/unattended/notice.h"

namespace cellcal::daemon {

struct Delivery {
  bool delivered = false;
  bool again = false;  ///< may succeed later; after a partial delivery, too
  std::string why;     ///< why it was not delivered, or not to all; empty: delivered
  /// Addresses to retry; empty: all.
  std::vector<std::string> left = {};
};

class Transfer {
 public:
  /// `ca`: PEM of the trusted authorities; empty: system store. Throws std::runtime_error: out of memory.
  Transfer(const std::string& url, const std::filesystem::path& ca, double timeout_s);
  ~Transfer();
  Transfer(const Transfer&) = delete;
  Transfer& operator=(const Transfer&) = delete;

  /// As curl_easy_setopt. Throws std::runtime_error where libcurl does not support the option.
  template <class Value>
  void set(::CURLoption option, Value value) {
    checked(::curl_easy_setopt(easy_, option, value));
  }

  /// End of a transfer, with the last status of the server (0: none).
  struct End {
    ::CURLcode code = CURLE_OK;
    int status = 0;
    std::string why;  ///< reason of a failure
  };
  End run();

 private:
  static void checked(::CURLcode code);

  ::CURL* easy_;
  double timeout_s_;
  char words_[CURL_ERROR_SIZE] = "";
};

/// A curl list with automatic release.
using CurlList = std::unique_ptr<::curl_slist, decltype(&::curl_slist_free_all)>;
/// Throws std::bad_alloc.
CurlList curl_list(const std::vector<std::string>& lines);

/// First line of the file; empty where none is configured. Throws std::runtime_error: missing, empty,
/// readable by everybody, or not usable in a header.
std::string read_secret(const std::filesystem::path& file);

// One POST of JSON over HTTP or HTTPS.

/// `secret` is sent as X-Cellcal-Secret unless empty.
Delivery post(const WebhookConfig& config, const std::string& secret, const std::string& json);

// Text of a mail, and its delivery through the system's mail program (sendmail's command line, as provided by
// postfix, exim, msmtp and others).
//
// The program inherits only PATH in an empty environment: no socket, no serial port, no blocked signal. It is
// waited for, and terminated after the time limit.

/// The complete mail with lines ended by LF, as sendmail expects. `date`: RFC 5322. `id`: letters and digits, unique per
/// mail. Not by curl_mime, which builds bodies for curl's own SMTP transfer: the mail is also handed to the local
/// sendmail program, so it is composed once here.
std::string mail_text(const MailConfig& config, const Message& message, const std::string& date,
                      const std::string& id);

Delivery send_mail(const MailConfig& config, const std::string& mail,
                   std::chrono::milliseconds longest = std::chrono::seconds(30));

// Delivery of one mail to a mail server (SMTP, RFC 5321).

/// `mail`: complete text with lines ended by LF. `password` is sent over TLS only, which the server has to offer if a
/// user is configured. After a 4yz answer to some addresses the delivery is to be repeated for those (`left`) only.
Delivery send_by_smtp(const MailConfig& config, const MailServer& server,
                      const std::string& password, const std::string& mail);

}  // namespace cellcal::daemon
