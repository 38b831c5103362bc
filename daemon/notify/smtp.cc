#include "daemon/notify/smtp.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <exception>
#include <string_view>

#include "daemon/files/printable.h"

namespace cellcal::daemon {

namespace {

std::string text_of(const MailServer& server) {
  const bool v6 = server.host.find(':') != std::string::npos;
  return fmt::format("{}://{}:{}", server.tls ? "smtps" : "smtp",
                     v6 ? "[" + server.host + "]" : server.host, server.port);
}

std::string with_crlf(const std::string& text) {
  std::string lines;
  for (const char c : text) {
    if (c == '\n') lines += '\r';
    lines += c;
  }
  return lines;
}

/// What the server answered with 4yz or 5yz.
struct Refusals {
  int count = 0;
  std::string last;
};

std::size_t listen(char* line, std::size_t one, std::size_t count, void* heard) {
  const std::string_view text(line, one * count);
  if (text.starts_with('4') || text.starts_with('5')) {
    auto& refusals = *static_cast<Refusals*>(heard);
    ++refusals.count;
    refusals.last = printable(std::string(text.substr(0, text.find_first_of("\r\n"))));
  }
  return text.size();
}

std::size_t read_on(char* into, std::size_t one, std::size_t count, void* left) {
  auto& text = *static_cast<std::string_view*>(left);
  const std::size_t taken = std::min(one * count, text.size());
  std::memcpy(into, text.data(), taken);
  text.remove_prefix(taken);
  return taken;
}

/// RFC 5321, 4.2.1: 4yz may succeed later, 5yz not. Where the line was lost before an answer it may, too.
Delivery judge(const Transfer::End& end, const Refusals& refusals) {
  if (end.code == CURLE_OK) {
    return {true, false,
            refusals.count == 0
                ? ""
                : fmt::format("not to {} of the addresses: {}", refusals.count, refusals.last)};
  }
  if (end.code == CURLE_LOGIN_DENIED)
    return {false, false, fmt::format("user or password refused ({})", end.status)};
  const bool refused = end.status >= 500 && end.status < 600;
  const bool for_good =
      refused || end.code == CURLE_SSL_CACERT_BADFILE || end.code == CURLE_USE_SSL_FAILED;
  return {false, !for_good,
          refused ? fmt::format("refused with {}: {}", end.status, end.why) : end.why};
}

}  // namespace

Delivery send_by_smtp(const MailConfig& config, const MailServer& server,
                      const std::string& password, const std::string& mail) {
  try {
    Transfer transfer(text_of(server), server.ca, server.timeout_s);
    const std::string from = "<" + config.from + ">";
    std::vector<std::string> to;
    for (const std::string& one : config.to) to.push_back("<" + one + ">");
    const CurlList list = curl_list(to);
    transfer.set(CURLOPT_PROTOCOLS_STR, "smtp,smtps");
    transfer.set(CURLOPT_USE_SSL,
                 static_cast<long>(server.starttls ? CURLUSESSL_ALL : CURLUSESSL_NONE));
    if (!server.user.empty()) {
      transfer.set(CURLOPT_USERNAME, server.user.c_str());
      transfer.set(CURLOPT_PASSWORD, password.c_str());
    }
    transfer.set(CURLOPT_MAIL_FROM, from.c_str());
    transfer.set(CURLOPT_MAIL_RCPT, list.get());
    // Who may not be written to, left or mistyped, keeps the mail from nobody else.
    transfer.set(CURLOPT_MAIL_RCPT_ALLLOWFAILS, 1L);
    Refusals refusals;
    transfer.set(CURLOPT_HEADERFUNCTION, &listen);
    transfer.set(CURLOPT_HEADERDATA, &refusals);
    const std::string text = with_crlf(mail);
    std::string_view left = text;
    transfer.set(CURLOPT_UPLOAD, 1L);
    transfer.set(CURLOPT_READFUNCTION, &read_on);
    transfer.set(CURLOPT_READDATA, &left);
    return judge(transfer.run(), refusals);
  } catch (const std::exception& error) {
    return {false, true, printable(error.what())};
  }
}

}  // namespace cellcal::daemon
