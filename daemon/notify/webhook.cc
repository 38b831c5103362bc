#include "daemon/notify/webhook.h"

#include <fmt/format.h>
#include <sys/stat.h>

#include <algorithm>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/ssl.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/ssl.hpp>
#include <fstream>
#include <stdexcept>

#include "calib/files/calibration_json.h"
#include "daemon/files/printable.h"

namespace cellcal::daemon {

namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = boost::beast::http;
namespace ssl = boost::asio::ssl;
using tcp = asio::ip::tcp;
using Code = boost::system::error_code;

/// The answer is of no interest but for its status.
constexpr std::uint64_t kMostAnswer = 64u << 10;
constexpr int kTooManyRequests = 429, kRequestTimeout = 408;

/// One attempt: each step begins the next, whatever fails ends it.
class Attempt {
 public:
  Attempt(const WebhookConfig& config, const std::string& secret, const std::string& json)
      : config_(config), resolver_(context_), tls_(ssl::context::tls_client), stream_(context_, tls_) {
    request_.method(http::verb::post);
    request_.target(config.url.target);
    request_.version(11);
    const bool v6 = config.url.host.find(':') != std::string::npos;
    const std::string host = v6 ? "[" + config.url.host + "]" : config.url.host;
    const bool usual = config.url.port == (config.url.tls ? "443" : "80");
    request_.set(http::field::host, usual ? host : host + ":" + config.url.port);
    request_.set(http::field::user_agent, std::string("cellcald/") + calib::software_version());
    request_.set(http::field::content_type, "application/json");
    request_.set(http::field::connection, "close");
    if (!secret.empty()) request_.set("X-Cellcal-Secret", secret);
    request_.body() = json;
    request_.prepare_payload();
    parser_.body_limit(kMostAnswer);
  }

  Delivery run() {
    if (config_.url.tls && !prepare_tls()) return result_;
    const auto wait = std::chrono::duration_cast<std::chrono::milliseconds>(
        std::chrono::duration<double>(config_.timeout_s));
    beast::get_lowest_layer(stream_).expires_never();
    resolver_.async_resolve(config_.url.host, config_.url.port,
                            [this](Code code, const tcp::resolver::results_type& found) {
                              if (failed(code, "its name cannot be resolved")) return;
                              connect(found);
                            });
    context_.run_for(wait);
    if (!ended_) end({false, true, fmt::format("no answer within {:g} s", config_.timeout_s)});
    return result_;
  }

 private:
  bool prepare_tls() {
    Code code;
    if (config_.ca.empty()) {
      tls_.set_default_verify_paths(code);
    } else {
      tls_.load_verify_file(config_.ca, code);
    }
    if (code) {
      end({false, false, fmt::format("{}: {}", config_.ca.string(), code.message())});
      return false;
    }
    tls_.set_options(ssl::context::default_workarounds | ssl::context::no_sslv2 |
                     ssl::context::no_sslv3 | ssl::context::no_tlsv1 | ssl::context::no_tlsv1_1);
    stream_.set_verify_mode(ssl::verify_peer);
    stream_.set_verify_callback(ssl::host_name_verification(config_.url.host));
    Code is_name;
    asio::ip::make_address(config_.url.host, is_name);
    if (is_name) ::SSL_set_tlsext_host_name(stream_.native_handle(), config_.url.host.c_str());
    return true;
  }

  void connect(const tcp::resolver::results_type& found) {
    beast::get_lowest_layer(stream_).async_connect(
        found, [this](Code code, const tcp::endpoint&) {
          if (failed(code, "cannot connect")) return;
          if (!config_.url.tls) return send(beast::get_lowest_layer(stream_));
          stream_.async_handshake(ssl::stream_base::client, [this](Code shaken) {
            if (failed(shaken, "TLS")) return;
            send(stream_);
          });
        });
  }

  template <class Stream>
  void send(Stream& stream) {
    http::async_write(stream, request_, [this, &stream](Code code, std::size_t) {
      if (failed(code, "cannot send")) return;
      http::async_read(stream, buffer_, parser_, [this](Code read, std::size_t) {
        if (failed(read, "no whole answer")) return;
        judge(static_cast<int>(parser_.get().result_int()));
      });
    });
  }

  void judge(int status) {
    if (status >= 200 && status < 300) return end({true, false, ""});
    const bool again = status >= 500 || status == kTooManyRequests || status == kRequestTimeout;
    end({false, again, fmt::format("answered with status {}", status)});
  }

  bool failed(Code code, const char* what) {
    if (!code) return false;
    end({false, true, printable(fmt::format("{}: {}", what, code.message()))});
    return true;
  }

  void end(Delivery result) {
    if (ended_) return;
    ended_ = true;
    result_ = std::move(result);
    context_.stop();
  }

  const WebhookConfig& config_;
  asio::io_context context_;
  tcp::resolver resolver_;
  ssl::context tls_;
  beast::ssl_stream<beast::tcp_stream> stream_;
  http::request<http::string_body> request_;
  http::response_parser<http::string_body> parser_;
  beast::flat_buffer buffer_;
  bool ended_ = false;
  Delivery result_;
};

}  // namespace

Delivery post(const WebhookConfig& config, const std::string& secret, const std::string& json) {
  try {
    return Attempt(config, secret, json).run();
  } catch (const std::exception& error) {
    return {false, true, printable(error.what())};
  }
}

std::string read_secret(const std::filesystem::path& file) {
  if (file.empty()) return "";
  struct ::stat status {};
  if (::stat(file.c_str(), &status) != 0)
    throw std::runtime_error(file.string() + ": there is no such file, or it cannot be read");
  if ((status.st_mode & S_IROTH) != 0)
    throw std::runtime_error(file.string() + ": everybody may read it. chmod o-r " + file.string());
  std::ifstream in(file);
  std::string line;
  std::getline(in, line);
  const bool sound = !line.empty() && line.size() <= 1000 &&
                     std::all_of(line.begin(), line.end(), [](char c) { return '!' <= c && c <= '~'; });
  if (!sound)
    throw std::runtime_error(file.string() +
                             ": its first line must be 1 to 1000 visible ASCII characters");
  return line;
}

}  // namespace cellcal::daemon
