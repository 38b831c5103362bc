#include "daemon/notify/smtp.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cstring>
#include <exception>
#include <string_view>
#include <utility>
#include <vector>

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

/// What the server answered to each "RCPT TO", in the order of the addresses.
struct Dialogue {
  std::vector<int> answers;  ///< 0: none yet
  std::string last_refusal;  ///< of these
  bool asked = false;        ///< the newest has no answer yet
};

bool is_later(int answer) { return answer >= 400 && answer < 500; }
bool is_never(int answer) { return answer >= 500 && answer < 600; }

int hear_ours(::CURL*, ::curl_infotype what, char* text, std::size_t size, void* dialogue) {
  if (what != CURLINFO_HEADER_OUT || !std::string_view(text, size).starts_with("RCPT TO:"))
    return 0;
  auto& kept = *static_cast<Dialogue*>(dialogue);
  kept.answers.push_back(0);
  kept.asked = true;
  return 0;
}

/// A line with a number and a space is an answer's last one (RFC 5321, 4.2.1).
std::size_t hear_its(char* line, std::size_t one, std::size_t count, void* dialogue) {
  const std::string_view text(line, one * count);
  auto& kept = *static_cast<Dialogue*>(dialogue);
  int answer = 0;
  const auto [end, wrong] = std::from_chars(text.data(), text.data() + text.size(), answer);
  const bool whole = wrong == std::errc() && end != text.data() + text.size() && *end != '-';
  if (!whole || !std::exchange(kept.asked, false)) return text.size();
  kept.answers.back() = answer;
  if (is_later(answer) || is_never(answer))
    kept.last_refusal = printable(std::string(text.substr(0, text.find_first_of("\r\n"))));
  return text.size();
}

std::size_t read_on(char* into, std::size_t one, std::size_t count, void* left) {
  auto& text = *static_cast<std::string_view*>(left);
  const std::size_t taken = std::min(one * count, text.size());
  std::memcpy(into, text.data(), taken);
  text.remove_prefix(taken);
  return taken;
}

/// Those whose answer is such; who was not asked has answer 0.
template <class Is>
std::vector<std::string> those(const std::vector<std::string>& to, const Dialogue& dialogue,
                               Is is) {
  std::vector<std::string> found;
  for (std::size_t i = 0; i < to.size(); ++i)
    if (is(i < dialogue.answers.size() ? dialogue.answers[i] : 0)) found.push_back(to[i]);
  return found;
}

/// RFC 5321, 4.2.1: 4yz may succeed later, 5yz not. Where the line was lost before an answer it may, too.
Delivery judge(const Transfer::End& end, const std::vector<std::string>& to,
               const Dialogue& dialogue) {
  const std::vector<std::string> later = those(to, dialogue, is_later),
                                 never = those(to, dialogue, is_never);
  if (end.code == CURLE_OK) {
    const std::size_t refused = later.size() + never.size();
    return {true, !later.empty(),
            refused == 0
                ? ""
                : fmt::format("not to {} of the addresses: {}", refused, dialogue.last_refusal),
            later};
  }
  if (end.code == CURLE_LOGIN_DENIED)
    return {false, false, fmt::format("user or password refused ({})", end.status)};
  // Where nobody was taken curl ends with the last answer, and the others may be busy only.
  if (later.size() + never.size() == to.size() && !later.empty())
    return {false, true, "refused: " + dialogue.last_refusal, later};
  const bool refused = is_never(end.status);
  const bool for_good =
      refused || end.code == CURLE_SSL_CACERT_BADFILE || end.code == CURLE_USE_SSL_FAILED;
  return {false, !for_good,
          refused ? fmt::format("refused with {}: {}", end.status, end.why) : end.why,
          those(to, dialogue, [](int answer) { return !is_never(answer); })};
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
    Dialogue dialogue;
    transfer.set(CURLOPT_HEADERFUNCTION, &hear_its);
    transfer.set(CURLOPT_HEADERDATA, &dialogue);
    transfer.set(CURLOPT_DEBUGFUNCTION, &hear_ours);
    transfer.set(CURLOPT_DEBUGDATA, &dialogue);
    transfer.set(CURLOPT_VERBOSE, 1L);
    const std::string text = with_crlf(mail);
    std::string_view left = text;
    transfer.set(CURLOPT_UPLOAD, 1L);
    transfer.set(CURLOPT_READFUNCTION, &read_on);
    transfer.set(CURLOPT_READDATA, &left);
    return judge(transfer.run(), config.to, dialogue);
  } catch (const std::exception& error) {
    return {false, true, printable(error.what())};
  }
}

}  // namespace cellcal::daemon
