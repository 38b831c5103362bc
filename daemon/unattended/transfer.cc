#include "daemon/unattended/transfer.h"

#include <fmt/format.h>
#include <sys/stat.h>

#include <algorithm>
#include <charconv>
#include <cstring>
#include <exception>
#include <fstream>
#include <new>
#include <stdexcept>
#include <string_view>
#include <utility>

#include "calib/files/calibration_json.h"
#include "calib/model/units.h"
#include "daemon/files/atomic_file.h"
#include "daemon/files/child.h"

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

/// RFC 2045: at most 76 characters per line.
constexpr std::size_t kLongestLine = 72;
constexpr int kTryLater = 75;  // EX_TEMPFAIL

bool plain(unsigned char c) { return (' ' <= c && c <= '~') && c != '='; }

std::string quoted_printable(const std::string& text) {
  std::string out;
  std::size_t column = 0;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const auto c = static_cast<unsigned char>(text[i]);
    if (c == '\n') {
      out += '\n';
      column = 0;
      continue;
    }
    const bool ends_line = i + 1 == text.size() || text[i + 1] == '\n';
    // A line with a single full stop ends the mail in old programs.
    const bool as_is = plain(c) && !(c == ' ' && ends_line) && !(c == '.' && column == 0);
    const std::string one =
        as_is ? std::string(1, static_cast<char>(c)) : fmt::format("={:02X}", c);
    if (column + one.size() > kLongestLine) {
      out += "=\n";
      column = 0;
    }
    out += one;
    column += one.size();
  }
  return out;
}

/// RFC 2047 encoded words, "=?utf-8?Q?...?=", without split characters.
std::string header_words(const std::string& text) {
  constexpr std::size_t kLongestWord = 60;
  std::string out, word;
  const auto put = [&] {
    if (word.empty()) return;
    out += (out.empty() ? "" : "\n ") + ("=?utf-8?Q?" + word + "?=");
    word.clear();
  };
  for (const char raw : text) {
    const auto c = static_cast<unsigned char>(raw);
    const bool begins_character = (c & 0xC0) != 0x80;
    if (begins_character && word.size() > kLongestWord) put();
    const bool letter = ('a' <= c && c <= 'z') || ('A' <= c && c <= 'Z') || ('0' <= c && c <= '9');
    word += c == ' ' ? "_" : letter ? std::string(1, raw) : fmt::format("={:02X}", c);
  }
  put();
  return out;
}

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

/// Answers of the server to each "RCPT TO", in the order of the addresses.
struct Dialogue {
  std::vector<int> answers;  ///< 0: none yet
  std::string last_refusal;  ///< the newest refusal among them
  bool asked = false;        ///< the newest is unanswered
};

bool is_later(int answer) { return answer >= 400 && answer < 500; }
bool is_never(int answer) { return answer >= 500 && answer < 600; }

int receive_own(::CURL*, ::curl_infotype what, char* text, std::size_t size, void* dialogue) {
  if (what != CURLINFO_HEADER_OUT || !std::string_view(text, size).starts_with("RCPT TO:"))
    return 0;
  auto& kept = *static_cast<Dialogue*>(dialogue);
  kept.answers.push_back(0);
  kept.asked = true;
  return 0;
}

/// A line with a number and a space is the last one of an answer (RFC 5321, 4.2.1).
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

/// Addresses whose answer satisfies the predicate; an address without an answer has 0.
template <class Is>
std::vector<std::string> those(const std::vector<std::string>& to, const Dialogue& dialogue,
                               Is is) {
  std::vector<std::string> found;
  for (std::size_t i = 0; i < to.size(); ++i)
    if (is(i < dialogue.answers.size() ? dialogue.answers[i] : 0)) found.push_back(to[i]);
  return found;
}

/// RFC 5321, 4.2.1: 4yz may succeed later, 5yz not. A lost connection before an answer may succeed, too.
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
  // With all addresses refused curl returns the last answer only; others may be temporary.
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
    case CURLE_COULDNT_RESOLVE_HOST: end.why = "its name cannot be resolved: " + words; break;
    case CURLE_COULDNT_CONNECT: end.why = "cannot connect: " + words; break;
    case CURLE_SSL_CONNECT_ERROR:
    case CURLE_PEER_FAILED_VERIFICATION:
    case CURLE_SSL_CACERT_BADFILE:
    case CURLE_USE_SSL_FAILED: end.why = "TLS: " + words; break;
    default: end.why = words;
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

std::string mail_text(const MailConfig& config, const Message& message, const std::string& date,
                      const std::string& id) {
  std::string to;
  for (const std::string& one : config.to) to += (to.empty() ? "" : ",\n ") + one;
  return fmt::format(
      "From: cellcal <{}>\nTo: {}\nSubject: {}\nDate: {}\nMessage-ID: <{}@{}>\nAuto-Submitted: auto-generated\n"
      "MIME-Version: 1.0\nContent-Type: text/plain; charset=utf-8\n"
      "Content-Transfer-Encoding: quoted-printable\n\n{}",
      config.from, to, header_words(message.subject), date, id,
      config.from.substr(config.from.find('@') + 1), quoted_printable(message.body));
}

Delivery send_mail(const MailConfig& config, const std::string& mail,
                   std::chrono::milliseconds longest) {
  const std::string program = config.program.string();
  Child child{.words = {program, "-i", "-f", config.from, "--"},
              .input = mail,
              .limit = longest,
              .environment = {"PATH=/usr/sbin:/usr/bin:/sbin:/bin"}};
  child.words.insert(child.words.end(), config.to.begin(), config.to.end());
  const ChildEnd end = run_child(child);
  if (end.why == ChildEnd::Why::kNotStarted)
    return {false, false, program + ": " + std::strerror(end.error)};
  if (end.why != ChildEnd::Why::kEnded) return {false, true, program + " did not end in time"};
  if (end.status == 0) return {true, false, ""};
  return {false, end.status == kTryLater || end.status < 0,
          fmt::format("{} ended with status {}", program, end.status)};
}

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
    // A refused address (left the company, mistyped) must not withhold the mail from the others.
    transfer.set(CURLOPT_MAIL_RCPT_ALLLOWFAILS, 1L);
    Dialogue dialogue;
    transfer.set(CURLOPT_HEADERFUNCTION, &hear_its);
    transfer.set(CURLOPT_HEADERDATA, &dialogue);
    transfer.set(CURLOPT_DEBUGFUNCTION, &receive_own);
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
